"""Many programmes at once: a policy of random rates drives eight arms on all cores; the place of the tool is the score."""

import numpy as np

import vgtsim
from vgtsim.batch import Batch

site = vgtsim.load("arm9_nullspace")
chain, rng, arms = site.chain, np.random.default_rng(1), 8
goal = site.task.motion.goals[0]
low, high = site.box.least, site.box.greatest

with Batch(site) as batch:
    steps = round(0.2 / batch.timestep)  # of a period of the policy
    states = np.repeat(batch.stand(site.start), arms, axis=0)
    lengths = np.repeat(chain.lengths(site.start)[None], arms, axis=0)
    played = batch.play(states, lengths[:, None])
    for _ in range(10):
        rates = rng.uniform(-0.02, 0.02, lengths.shape)  # m/s; a policy of one's own goes here
        ends = np.clip(lengths + rates * steps * batch.timestep, low, high)
        way = np.arange(1, steps + 1)[:, None] / steps
        played = batch.play(states, lengths[:, None] + way * (ends - lengths)[:, None])
        states, lengths = played.last, ends
    gaps = batch.measure_gaps(states)

far = np.linalg.norm(played.tool[:, -1] - np.array(goal.position), axis=-1)
best = int(np.argmin(far))
print(f"{arms} arms moved for {states[0, 0]:.1f} s; arm {best} came nearest to {goal.name}, {far[best]:.2f} m away")
posture = vgtsim.forward_kinematics(site, lengths=lengths[best])
print(f"its tool is at z = {played.tool[best, -1, 2]:.3f} m, expected {posture.tool[2]:.3f} m")
print(f"loops are open by at most {1e3 * gaps.max():.1f} mm, expected {0:.1f} mm")
