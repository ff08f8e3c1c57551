"""Film a run: members coloured by their axial force. Needs EGL (apt-get install libegl1 libgl1-mesa-dri)."""

from pathlib import Path

import imageio.v3 as imageio

import vgtsim

TASK = """
base = "arm9_nullspace"
name = "one_goal"
[motion]
hold = "0.5 s"
goals = [{ name = "heel", position = ["-6.76 m", "-1.81 m", "0.95 m"], direction = [-0.889, -0.238, -0.391] }]
[video]
width = 320
height = 240
fps = 5
speed = 10.0  # simulated seconds in a second of film: a dozen frames
"""
(folder := Path("out/12")).mkdir(parents=True, exist_ok=True)
(folder / "task.toml").write_text(TASK)

site = vgtsim.load(folder / "task.toml")
log = vgtsim.run(site, vgtsim.plan(site))
path = vgtsim.render(site, log, vgtsim.verify(site, log), folder)
video = site.task.video
frames = [frame.shape for frame in imageio.imiter(path)]
print(f"{path}: {len(frames)} frames, expected {1 + int(log.time[-1] * video.fps / video.speed)}")
print(f"each {frames[0][1]} pixels wide, expected {video.width}")
