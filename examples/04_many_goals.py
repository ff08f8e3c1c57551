"""Many goals at once: one batch of postures, each the best by an objective, thousands a second."""

from time import process_time

import numpy as np

import vgtsim
from vgtsim.positioning import MidStroke, Problem, make_box, solve, tool_goal

arm = vgtsim.load_arm("arm15")
box = make_box(arm, 0.005)  # the strokes, less 5 mm at both ends
start = vgtsim.solve_goal(arm, (7.0, 1.0, -8.0), (0.8, 0.1, -0.6))

# A ring of goals about that one; each posture starts from the same configuration.
angle = np.linspace(0, 2 * np.pi, 400, endpoint=False)
ring = np.stack([np.zeros(len(angle)), np.cos(angle), np.sin(angle)], axis=-1)
position = start.tool + 0.3 * ring
direction = np.broadcast_to(start.direction, position.shape)
problem = Problem(box, tool_goal(position, direction), MidStroke())
begin = process_time()
found = solve(problem, np.broadcast_to(start.q, (len(angle), len(start.q))))
spent = process_time() - begin
print(f"{len(angle)} goals in {spent:.2f} s, {np.mean(found.iterations):.1f} iterations each")
print(f"goals met: {np.sum(found.met)}, expected {len(angle)}")
print(f"local minima to second order: {np.sum(found.optimal)} of {len(angle)}")

posture = vgtsim.forward_kinematics(arm, found.q)
print(f"greatest error of the tool {np.linalg.norm(posture.tool - position, axis=-1).max():.6f} m, expected {0:.6f} m")

# At an optimum the objective has no slope along directions that leave the tool at rest.
print(f"greatest slope in the null space over the whole slope: {found.stationarity.max():.1e}")
