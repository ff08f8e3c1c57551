"""A model of this project in plain MuJoCo: hold a pose, lengthen a cylinder by its control in metres, read the sensors."""

import mujoco
import numpy as np

import vgtsim
from vgtsim.mjcf.build import reach_pose

model = vgtsim.load_model("arm9")  # the shipped scene.xml, with the weights that keep its loops closed
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, model.key("reach").id)
mujoco.mj_forward(model, data)
print(f"{model.nbody} bodies, {model.nv} degrees of freedom, {model.neq} equalities, {model.nu} servos")

# The keyframe is the posture of the kinematics, from a flange that the model puts at its own height.
arm = vgtsim.load_arm("arm9", height=data.site("mast/flange").xpos[2])
posture = vgtsim.forward_kinematics(arm, reach_pose(arm))
tool = data.site("tool").xpos
print(f"tool in MuJoCo at x = {tool[0]:.3f} m, expected {posture.tool[0]:.3f} m")
print(f"               and z = {tool[2]:.3f} m, expected {posture.tool[2]:.3f} m")


def run(seconds: float) -> None:
    """Step under the controls as they are."""
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)


run(1.0)
weight = np.linalg.norm(data.sensor("mast/flange/force").data)
forces = vgtsim.member_forces(arm, posture.q)
print(f"after {data.time:.1f} s the mast carries {weight / 1e3:.2f} kN, expected {forces.reaction[2] / 1e3:.2f} kN")
bar = np.abs(forces.bar[arm.truss.actuated])
cylinders = [arm.truss.member_names[i] for i in arm.truss.actuated]
servo = [abs(data.actuator(f"{name}/servo").force[0]) for name in cylinders]
print(f"greatest servo force {max(servo) / 1e3:.1f} kN, expected {bar.max() / 1e3:.1f} kN")

# Controls, joints and length sensors are lengths from pin to pin in metres. A jump is followed at no more than the rated speed.
lengths = np.array([data.sensor(f"{name}/length").data[0] for name in cylinders])
data.actuator(f"{cylinders[0]}/servo").ctrl += 0.03
lengths[0] += 0.03
run(4.0)
moved = vgtsim.forward_kinematics(arm, lengths=lengths)
tool = data.site("tool").xpos
print(f"first cylinder 30 mm longer: tool at x = {tool[0]:.2f} m, expected {moved.tool[0]:.2f} m")
