"""A live loop: a proportional hand steers the tool, and the controller keeps the arm inside all limits."""

import numpy as np

import vgtsim

site = vgtsim.load("arm9_nullspace")
plant = vgtsim.Plant(site)
controller = vgtsim.Controller(site, plant.timestep)
state = plant.reset()
controller.start(state.commanded, site.start)

# An own controller on top: it looks at the tool and commands a velocity towards a point, ten times a second.
goal = state.tool_position + [0.3, 0.3, -0.2]
every = round(0.1 / plant.timestep)
for k in range(round(14.0 / plant.timestep)):
    if k % every == 0:
        velocity = 0.5 * (goal - plant.state.tool_position)  # m/s; the controller bounds and filters it
        controller.command(twist=[*velocity, 0, 0, 0])
    plant.command(controller.step(plant.state))
    plant.step()
left = np.linalg.norm(plant.state.tool_position - goal)
print(f"distance from the point {left:.2f} m, expected {0:.2f} m; limits in the way: {controller.report.held_by}")

# The same loop with a goal that cannot be had: the controller slows, stops, and says why.
controller.command(goal=[*(plant.state.tool_position + [0, 0, -9.0]), *plant.state.tool_direction])
for _ in range(round(25.0 / plant.timestep)):
    plant.command(controller.step(plant.state))
    plant.step()
report = controller.report
print(f"held by {report.held_by[0]}; {report.part:.0%} of the wish is done")

# What was driven is judged by the same means as a tour: MuJoCo's tool is where kinematics has it.
posture = vgtsim.forward_kinematics(site, lengths=plant.state.lengths)
off = np.linalg.norm(plant.state.tool_position - posture.tool)
print(f"tool from kinematics {off:.5f} m, expected {0:.5f} m; contacts: {len(plant.log.contact_time)}, expected {0}")
