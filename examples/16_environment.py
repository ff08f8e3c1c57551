"""A Gymnasium environment: a scripted policy reaches a goal in kinematics, then the same actions in the plant."""

import gymnasium
import numpy as np

import vgtsim
import vgtsim.envs  # registers the ids; needs the extra `env`

env = gymnasium.make("vgtsim/Reach-arm9-v0")
arm = env.unwrapped
assert isinstance(arm, vgtsim.envs.ArmEnv)
observation, info = env.reset(seed=1)
print(f"{observation.size} observations, {len(arm.rated)} actions, {info['left']:.2f} m left to do")

actions, total, done = [], 0.0, False
while not done:
    actions.append(vgtsim.envs.steer(arm))  # your policy goes here
    observation, reward, terminated, truncated, info = env.step(actions[-1])
    total, done = total + float(reward), terminated or truncated
print(f"after {len(actions) / 2:.1f} s: return {total:.2f}, success {info['is_success']}, fault '{info['fault']}'")

exact = gymnasium.make("vgtsim/Reach-arm9-v0", tier="exact")
there, _ = exact.reset(seed=1)
for action in actions:
    there, *_ = exact.step(action)
print(f"observations of both tiers differ by {np.abs(there - observation).max():.4f}, expected {0:.4f}")

plant = exact.get_wrapper_attr("tier").plant
posture = vgtsim.forward_kinematics(arm.site, arm.tier.state.q[0])
print(f"tool in the plant at z = {plant.state.tool_position[2]:.4f} m, expected {posture.tool[2]:.4f} m")
