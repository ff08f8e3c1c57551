"""Step the plant from a program, with commands of the program: the same plant plays a tour."""

import numpy as np

import vgtsim

site = vgtsim.load("arm9_nullspace")
plant = vgtsim.Plant(site, record_rate=20.0)
state = plant.reset()  # the start of the scene, at rest
start = state.lengths

# Drive two cylinders by their rates for two seconds, and ramp these rates so that the arm is not jerked.
rates = np.zeros(len(start))
rates[0], rates[1] = 0.01, -0.01  # m/s
seconds, ramp = 2.0, 0.5
steps = round(seconds / plant.timestep)
for k in range(steps):
    now = k * plant.timestep
    share = min(1.0, now / ramp, (seconds - now) / ramp)
    plant.command(rates=share * rates)
    plant.step()
moved = rates[0] * (seconds - ramp)
print(f"first cylinder moved by {1e3 * (plant.state.lengths[0] - start[0]):.2f} mm, expected {1e3 * moved:.2f} mm")

# Hold the last command until the arm is calm, then compare MuJoCo with the kinematics of the same lengths.
plant.command(plant.state.commanded)
while not plant.calm and not plant.stopped:
    plant.step()
state = plant.state
posture = vgtsim.forward_kinematics(site, lengths=state.lengths)
print(f"calm after {plant.time:.2f} s; tool at z = {state.tool_position[2]:.5f} m, expected {posture.tool[2]:.5f} m")
off = np.linalg.norm(state.nodes - posture.nodes, axis=-1).max()
print(f"greatest distance of a node from kinematics {off:.6f} m, expected {0:.6f} m")

# The drives carry the weight: member forces of the same posture, from statics alone.
bar = vgtsim.member_forces(site, posture.q).bar[site.truss.actuated]
k = int(np.argmax(np.abs(bar)))
print(f"force of the most loaded drive {state.drive_force[k] / 1e3:.2f} kN, expected {bar[k] / 1e3:.2f} kN")
print(f"log: {len(plant.log.time)} records; contacts: {len(plant.log.contact_time)}, expected {0}")
