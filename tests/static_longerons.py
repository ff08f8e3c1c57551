"""A small scene of an arm with static longerons: three octahedra, of which two have some, and two goals near its start."""

from __future__ import annotations

import dataclasses

import numpy as np

from vgtsim.constants import Method
from vgtsim.description import Scene, load_scene
from vgtsim.description.modules import Longeron
from vgtsim.kinematics import Subspace
from vgtsim.site import Site

STATIC = {"p2": (0, 2, 4), "p3": (1, 5)}  # longerons that are tubes
BENDS = (0.35, 0.14, 0.1)  # of the start, rad


def make_static_scene() -> Scene:
    """Thirteen actuators in the tank of the arm of thirty; the goals are tool points and directions of near postures."""
    scene = load_scene("arm30_shape")
    tube = scene.manipulator.modules[0].batten_tube
    modules = []
    for module in scene.manipulator.modules[:6]:
        if module.kind == "prism":
            modules.append(module.model_copy(update={"length": 1.0}))
            continue
        longerons = list(module.longerons)
        for i in STATIC.get(module.name, ()):
            longerons[i] = Longeron(tube=tube, length=module.straight)
        modules.append(module.model_copy(update={"longerons": tuple(longerons)}))
    arm = scene.manipulator.model_copy(update={"modules": tuple(modules)})
    start = [
        bend.model_copy(update={"angle": angle}) for bend, angle in zip(scene.task.motion.start, BENDS, strict=False)
    ]
    changes = {"method": Method.NULLSPACE, "objective": ("mid_stroke",), "start": tuple(start), "hold": 0.2}
    motion = scene.task.motion.model_copy(update=changes)
    site = Site(dataclasses.replace(scene, manipulator=arm, task=scene.task.model_copy(update={"motion": motion})))
    space, step = Subspace(site.chain), 0.08 * np.sin(np.arange(1.0, 1.0 + site.chain.layout.inputs))
    near = space.project(np.array([site.start + step, site.start - 0.7 * step]))
    position, direction = site.chain.tool(near)
    goals = tuple(
        goal.model_copy(update={"position": tuple(p), "direction": tuple(d)})
        for goal, p, d in zip(motion.goals[:2], position.tolist(), direction.tolist(), strict=True)
    )
    motion = motion.model_copy(update={"goals": goals})
    task = site.task.model_copy(update={"motion": motion})
    return dataclasses.replace(site.scene, task=task)
