"""One tool goal: a posture inside the strokes, by different objectives; and a goal out of reach."""

import numpy as np

import vgtsim
from vgtsim.errors import ReachError

arm = vgtsim.load_arm("arm15")
position, direction = np.array([7.0, 1.0, -8.0]), np.array([0.8, 0.1, -0.6])
direction /= np.linalg.norm(direction)

# Fifteen inputs meet five rows; an objective chooses among the postures that are left.
for objective in ("mid_stroke", "condition_number", ("mid_stroke", "in_plane:10")):
    posture = vgtsim.solve_goal(arm, position, direction, objective=objective)
    J = vgtsim.jacobian(arm, posture.q)
    off = np.linalg.norm(posture.tool - position)
    spare = np.min([posture.lengths - arm.stroke[0], arm.stroke[1] - posture.lengths])
    print(f"{objective!s}: stroke to spare {1e3 * spare:.0f} mm, condition number {np.linalg.cond(J):.1f}")
    print(f"  tool off by {off:.6f} m, expected {0:.6f} m")
    print(f"  direction along the goal's: {posture.direction @ direction:.6f}, expected {1:.6f}")

try:
    vgtsim.solve_goal(arm, (30.0, 0.0, 0.0), direction)
except ReachError as error:  # the error carries its evidence
    print(
        f"a goal 30 m out: {error.shortfall:.1f} m short, {len(error.binding)} cylinders at the ends of their strokes"
    )
