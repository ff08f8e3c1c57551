"""The payload that an arm may carry in a posture, and the member or cylinder that limits it."""

import numpy as np

import vgtsim
from vgtsim.statics.capacity import LIMITS, find_allowance

GRAVITY, OMEGA = 9.80665, 1.67  # m/s²; safety factor of AISC 360 on member strength
arm = vgtsim.load_arm("arm15")
names = arm.truss.member_names

# From hanging to level: the farther out the tool, the less it may carry.
goals = [
    ((4.0, 0.0, -11.5), (0.6, 0.0, -0.8)),
    ((7.0, 0.0, -9.5), (0.8, 0.0, -0.6)),
    ((10.5, 0.0, -5.0), (1.0, 0.0, 0.0)),
]
for position, direction in goals:
    posture = vgtsim.solve_goal(arm, position, direction)
    found = find_allowance(arm, posture.nodes, GRAVITY, OMEGA, radius=0.15)
    member, payload = int(found.member), float(found.payload)
    out = np.hypot(*posture.tool[:2])
    print(f"tool {out:.2f} m out: {payload:.0f} kg, limited by the {LIMITS[int(found.limit)]} of {names[member]}")

    # At that payload the greatest axial force along the member is its limit, of yield or of oil pressure.
    force = vgtsim.member_forces(arm, posture.q, payload=payload).along[:, member]
    part = arm.truss.members[member]
    if part.role == "actuator":
        limit = arm.manipulator.cylinders[part.section].push
    else:
        tube = arm.manipulator.tubes[part.section]
        steel = arm.manipulator.materials[tube.material]
        wall = steel.design_wall * tube.wall  # AISC 360 B4.2: what counts of the nominal wall
        limit = steel.yield_strength * np.pi * (tube.outer_diameter - wall) * wall / OMEGA
    print(f"  force there {np.abs(force).max() / 1e3:.2f} kN, expected {limit / 1e3:.2f} kN")
