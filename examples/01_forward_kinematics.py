"""Forward kinematics: where the tool of an arm is for given cylinder lengths, one posture or thousands at once."""

import numpy as np

import vgtsim

arm = vgtsim.load_arm("arm15", height=7.32)  # hangs with its base face 7.32 m above the floor
straight = vgtsim.forward_kinematics(arm)
print(f"{len(arm.truss.nodes)} nodes, {len(arm.truss.member_names)} members, {len(straight.lengths)} cylinders")

# The arm is 45 ft (13.716 m) long from the flange to the tool.
print(f"straight arm: tool at z = {straight.tool[2]:.3f} m, expected {7.32 - 13.716:.3f} m")
print(f"the tool points down: z = {straight.direction[2]:.6f}, expected {-1:.6f}")

# Longer cylinders bring the faces of their module together: the arm becomes shorter.
longer = vgtsim.forward_kinematics(arm, lengths=straight.lengths + 0.02)
print(f"every cylinder 20 mm longer: the arm is {1e3 * (longer.tool[2] - straight.tool[2]):.1f} mm shorter")

# A batch: leading dimensions are free.
rng = np.random.default_rng(1)
lengths = straight.lengths + rng.uniform(-0.05, 0.05, (2000, len(straight.lengths)))
batch = vgtsim.forward_kinematics(arm, lengths=lengths)
reach = np.hypot(*batch.tool[:, :2].T)
print(
    f"{len(batch.tool)} postures of cylinders within 50 mm: the tool is up to {reach.max():.2f} m off the mast's axis"
)

# The nodes give the lengths back: each member is as long as its two nodes are apart.
members = arm.truss.lengths(batch.nodes)[:, arm.truss.actuated]
print(f"greatest error of a cylinder's length: {np.abs(members - lengths).max():.6f} m, expected {0:.6f} m")
