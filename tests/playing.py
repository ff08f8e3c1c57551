"""Plays a motion given as inputs into a scene, with the model edited on the way if a test wants it spoilt."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Callable

import mujoco
import numpy as np

from vgtsim.description import Feed, Scene, Slew
from vgtsim.log import RunLog
from vgtsim.mjcf import build_spec, finish_model
from vgtsim.planning import Leg, Tour
from vgtsim.plant import run
from vgtsim.site import Site

Edit = Callable[[mujoco.MjSpec], None]
_FREE: list[tuple[Scene, mujoco.MjModel]] = []  # what was compiled last


def shorten(scene: Scene, active: int) -> Scene:
    """The scene with only the first modules of its arm, one free goal, and a short hold."""
    arm = scene.manipulator.model_copy(update={"modules": scene.manipulator.modules[: 2 * active]})
    motion = scene.task.motion
    motion = motion.model_copy(update={"start": motion.start[:active], "goals": motion.goals[:1], "hold": 0.2})
    task = scene.task.model_copy(update={"motion": motion})
    return dataclasses.replace(scene, manipulator=arm, task=task)


def change(scene: Scene, **updates: object) -> Scene:
    """The scene with other settings of the step loop."""
    simulation = scene.task.simulation.model_copy(update=updates)
    return dataclasses.replace(scene, task=scene.task.model_copy(update={"simulation": simulation}))


def bend(scene: Scene, angles: list[float], azimuths: list[float]) -> np.ndarray:
    """Inputs of a pose from each module's bend, rad."""
    q = np.array(Site(scene).chain.straight)
    tilt = np.sin(np.array(angles) / 2)
    q[::3], q[1::3] = tilt * np.cos(azimuths), tilt * np.sin(azimuths)
    return q


def out_of_the_tank(spec: mujoco.MjSpec) -> None:
    """An edit that takes the tank away, whose two thousand geoms cost an eighth of each step, and lets nothing else touch."""
    spec.delete(spec.body("tank"))
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0


def build_in_free_air(scene: Scene) -> mujoco.MjModel:
    """The model of a scene without its tank; scenes that are equal are compiled once."""
    model = next((model for known, model in _FREE if known == scene), None)
    if model is None:
        spec = build_spec(Site(scene))
        out_of_the_tank(spec)
        model = finish_model(spec, Site(scene))
        _FREE[:] = [(scene, model), *_FREE[:7]]
    return copy.copy(model)


def play(scene: Scene, start: np.ndarray, end: np.ndarray, duration: float, edit: Edit | None = None) -> RunLog:
    """Move from one pose to another, smoothly, and hold."""
    step = Site(scene).timestep
    s = np.linspace(0, 1, max(round(duration / step), 1) + 1)[:, None]
    s = s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3)
    lengths = Site(scene).chain.lengths(start + s * (end - start))
    program = Tour(start, (Leg("goal", 0, lengths, end, 1.0, "nothing"),), step)
    if edit is None:
        return run(Site(scene), program)
    if edit is out_of_the_tank:
        return run(Site(scene), program, build_in_free_air(scene))
    spec = build_spec(Site(scene))
    edit(spec)
    return run(Site(scene), program, finish_model(spec, Site(scene)))


def hoist(scene: Scene, **figures: float) -> Scene:
    """The scene with a feed of its mast."""
    feed = Feed(**{"stroke": 20.0, "rate": 0.6, "acceleration": 1.0, "force": 6e4} | figures)
    mast = scene.task.mast.model_copy(update={"feed": feed})
    return dataclasses.replace(scene, task=scene.task.model_copy(update={"mast": mast}))


def slew(scene: Scene, **figures: float) -> Scene:
    """The scene with a mast that turns."""
    turn = Slew(**{"range": (-2.0, 2.5), "rate": 0.6, "acceleration": 1.0, "torque": 1e4} | figures)
    mast = scene.task.mast.model_copy(update={"turn": turn})
    return dataclasses.replace(scene, task=scene.task.model_copy(update={"mast": mast}))


def climb(height: float, seconds: float, step: float) -> np.ndarray:
    """Heights on a smooth way from 0, m, at every step."""
    s = np.linspace(0, 1, round(seconds / step) + 1)
    return height * s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3)
