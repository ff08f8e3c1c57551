"""The Jacobian of the tool in closed form, held against differences; condition number and a null-space motion."""

import numpy as np

import vgtsim

arm = vgtsim.load_arm("arm15")
rng = np.random.default_rng(2)
q = arm.straight + rng.uniform(-0.1, 0.1, arm.straight.shape)
J = vgtsim.jacobian(arm, q)
print(f"Jacobian of shape {J.shape}: velocity of the tool, then angular velocity, for each of {len(q)} inputs")

# Central differences of the tool point, all inputs in one batch.
step = 1e-6
ahead, behind = (vgtsim.forward_kinematics(arm, q + side * step * np.eye(len(q))).tool for side in (1, -1))
slope = (ahead - behind).T / (2 * step)
print(f"first column by differences: {slope[0, 0]:.5f} m, expected {J[0, 0]:.5f} m")
print(f"greatest difference in all columns: {np.abs(slope - J[:3]).max():.6f} m, expected {0:.6f} m")

# Fifteen inputs for a tool pose of six: nine directions leave the tool where it is.
singular = np.linalg.svd(J, compute_uv=False)
null = np.linalg.svd(J)[2][6:]
print(f"directions that leave the tool at rest: {len(null)}, expected {len(q) - 6}")
print(f"condition number {singular[0] / singular[-1]:.1f}")

moved = vgtsim.forward_kinematics(arm, q + 1e-3 * null[0])
rest = vgtsim.forward_kinematics(arm, q)
print(
    f"a step along the first of them moves nodes by {1e3 * np.abs(moved.nodes - rest.nodes).max():.2f} mm, "
    f"and the tool by {1e3 * np.linalg.norm(moved.tool - rest.tool):.3f} mm"
)
