"""Small scenes of arms of kinds that no shipped scene has: goals near the start, in a shipped scene's tank."""

from __future__ import annotations

import dataclasses

import numpy as np

from vgtsim.constants import Method
from vgtsim.description import Manipulator, Scene, load_manipulator, load_scene
from vgtsim.description.modules import GeneralDoubleOctahedral, Longeron
from vgtsim.description.motion import StartPosture
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


def make_general_arm() -> Manipulator:
    """The arm of nine actuators with general double octahedra, no two longerons of one alike."""
    arm = load_manipulator("arm9")
    modules = []
    for number, module in enumerate(arm.modules):
        if module.kind == "double_octahedral":
            cylinder = arm.cylinders[module.cylinder]
            same = {name: getattr(module, name) for name in ("name", "longeron_tube", "batten_tube", "cylinder")}
            lengths = module.longeron * (1 + 1e-3 * np.sin(3.0 * np.arange(12) + number))
            module = GeneralDoubleOctahedral(
                kind="double_octahedral_general",
                longerons=tuple(lengths.tolist()),
                straight=cylinder.retracted + cylinder.stroke / 2,
                **same,
            )
        modules.append(module)
    return arm.model_copy(update={"modules": tuple(modules)})


def make_general_scene() -> Scene:
    """A start that is searched, and one goal near it."""
    scene = dataclasses.replace(load_scene("arm9_nullspace"), manipulator=make_general_arm())
    mast = scene.task.mast.model_copy(update={"riser_spare": 0.02})  # no two longerons are alike, so the arm is thicker
    motion = scene.task.motion.model_copy(update={"start": None, "hold": 0.2, "goals": scene.task.motion.goals[:1]})
    site = Site(dataclasses.replace(scene, task=scene.task.model_copy(update={"motion": motion, "mast": mast})))
    position, direction = site.chain.tool(site.start + 0.03 * np.sin(np.arange(1.0, 10.0)))
    update = {"position": tuple(position.tolist()), "direction": tuple(direction.tolist())}
    start = StartPosture(inputs=tuple(site.start.tolist()))
    motion = motion.model_copy(update={"start": start, "goals": (motion.goals[0].model_copy(update=update),)})
    return dataclasses.replace(site.scene, task=site.task.model_copy(update={"motion": motion}))
