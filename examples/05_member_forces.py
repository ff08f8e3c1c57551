"""Forces in all members of a posture at rest, by the method of joints."""

import numpy as np

import vgtsim

arm = vgtsim.load_arm("arm15")
posture = vgtsim.solve_goal(arm, (9.0, 0.0, -5.0), (1.0, 0.0, 0.0))
payload = 453.59237  # kg, 1000 lb
empty, loaded = (vgtsim.member_forces(arm, posture.q, payload=mass) for mass in (0.0, payload))

# The mast carries the weight; the payload adds its own, and its moment about the pivot.
added = loaded.reaction - empty.reaction
print(f"the payload adds {added[2]:.2f} N to the mast, expected {payload * 9.80665:.2f} N")
print(
    f"and a moment of {np.hypot(*added[3:5]):.1f} N*m, expected {payload * 9.80665 * np.hypot(*posture.tool[:2]):.1f} N*m"
)

names = arm.truss.member_names
order = np.argsort(-np.abs(loaded.bar))
print("members with the greatest axial forces:")
for i in order[:5]:
    kind = "pulled" if loaded.bar[i] > 0 else "pushed"
    print(
        f"  {names[i]}: {kind} with {abs(loaded.bar[i]) / 1e3:.1f} kN, {abs(empty.bar[i]) / 1e3:.1f} kN without the payload"
    )

# Statics is linear in the load: half the payload, half the difference.
half = vgtsim.member_forces(arm, posture.q, payload=payload / 2)
print(f"half the payload: {half.bar[order[0]]:.3f} N, expected {(empty.bar + loaded.bar)[order[0]] / 2:.3f} N")
