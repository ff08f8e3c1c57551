"""Change the task of a shipped scene: plan the tour, look at the plan, plot the cylinder lengths."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import vgtsim

TASK = """
base = "arm9_nullspace"  # arm, tank, payload and limits; what follows stands in place of its entries
name = "mine"
[motion]
clearance = "0.12 m"
goals = [
    { name = "heel", position = ["-6.76 m", "-1.81 m", "0.95 m"], direction = [-0.889, -0.238, -0.391] },
    { name = "mid", position = ["-5.08 m", "6.05 m", "2.40 m"], direction = [-0.637, 0.759, -0.139] },
]
"""
(folder := Path("out/08")).mkdir(parents=True, exist_ok=True)
(folder / "mine.toml").write_text(TASK)

site = vgtsim.load(folder / "mine.toml")
tour = vgtsim.plan(site)
for leg in tour.legs:
    end = vgtsim.forward_kinematics(site, lengths=leg.lengths[-1])
    off = np.linalg.norm(end.tool - site.task.motion.goals[leg.goal].position)
    print(
        f"{leg.name}: {tour.timestep * (len(leg.lengths) - 1):.1f} s, clearance {leg.clearance:.3f} m near {leg.place}"
    )
    print(f"  tool at its end {1e3 * off:.4f} mm from the goal, expected {0:.4f} mm")

lengths = np.concatenate([leg.lengths for leg in tour.legs]).reshape(-1, site.chain.layout.actuators)
rate = np.abs(np.diff(lengths, axis=0)).max() / tour.timestep
rated = next(iter(site.arm.cylinders.values())).rate * site.task.motion.rate_fraction
print(f"greatest rate of a cylinder {1e3 * rate:.2f} mm/s, of {1e3 * rated:.2f} mm/s allowed")

figure = Figure(figsize=(8, 4), layout="constrained")
axes = figure.add_subplot(xlabel="time/s", ylabel="length/m", title=site.task.title)
axes.plot(tour.timestep * np.arange(len(lengths)), lengths)
figure.savefig(folder / "lengths.png")
print(folder / "lengths.png")
