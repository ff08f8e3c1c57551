"""A mission in phases: in each the arm keeps its length, so that each is a scene of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from vgtsim.description.manipulator import Manipulator
from vgtsim.description.mission import AddStep, CutStep, HoldStep, InsertStep, MissionStep, WithdrawStep
from vgtsim.description.scene import Phase, Scene

_LEFT = ("mission.", "motion.start")  # keys whose figures are others in a phase, or not there


@dataclass
class _Part:
    """A part of a mission: active modules of its arm, its steps, whether the arm stands in the clamp, and a pivot depth, m."""

    modules: int
    steps: list[MissionStep]
    stands: bool = False
    depth: float | None = None


def cut_arm(arm: Manipulator, first: int) -> Manipulator:
    """The part of an arm from a module on to its tool, which hangs by the base of that module."""
    modules = arm.modules[first:]
    return arm.model_copy(update={"name": f"{arm.name}_from_{modules[0].name}", "modules": modules})


def shorten_arm(arm: Manipulator, count: int) -> Manipulator:
    """The part of an arm with a number of its active modules, from the tool; the static sections below each belong to it."""
    if count == len(arm.active):
        return arm
    return cut_arm(arm, arm.modules.index(arm.active[-count]))


def list_phases(scene: Scene) -> tuple[Scene, ...]:
    """The phases of a scene's mission in their order, each as a scene; of any other scene, and of a phase, itself."""
    task, whole = scene.task, len(scene.manipulator.active)
    if task.phase is not None or not task.mission:
        return (scene,)
    parts = _split(task.mission, whole)
    if len(parts) == 1 and (parts[0].modules, parts[0].stands, parts[0].depth) == (whole, False, None):
        return (scene,)
    patches = tuple(dict.fromkeys(step.patch for step in task.mission if isinstance(step, CutStep)))
    provenance = {key: label for key, label in task.provenance.items() if not key.startswith(_LEFT)}
    anywhere = task.motion.model_copy(update={"start": None})  # a shorter arm has other postures
    phases = []
    for number, part in enumerate(parts, start=1):
        said = f"phase {number} of {len(parts)}, {part.modules} module{'s' * (part.modules > 1)}"
        changed = {
            "title": f"{task.title}: {said}",
            "mission": tuple(part.steps),
            "motion": task.motion if part.modules == whole else anywhere,
            "phase": Phase(number=number, count=len(parts), stands=part.stands, patches=patches),
            "provenance": provenance,
        }
        if part.depth is not None:
            changed["mast"] = task.mast.model_copy(update={"pivot_depth": part.depth})
            changed["provenance"] = {key: label for key, label in provenance.items() if key != "mast.pivot_depth"}
        arm = shorten_arm(scene.manipulator, part.modules)
        phases.append(replace(scene, task=task.model_copy(update=changed), manipulator=arm))
    return tuple(phases)


def begins_anew(scene: Scene) -> bool:
    """Whether nothing is in the tank when a phase begins."""
    step = scene.task.mission[0]
    return isinstance(step, InsertStep) or (isinstance(step, AddStep) and len(scene.manipulator.active) == 1)


def pick_phase(scene: Scene, like: Scene) -> Scene:
    """The phase of a scene that has the number of another scene's; the scene itself where that is no phase.

    Raises:
        DescriptionError: The scene has no such phase.
    """
    phase, phases = like.task.phase, list_phases(scene)
    if phase is None:
        return scene
    if phases[0].task.phase is None or phase.count != len(phases):
        found = f"a mission of {len(phases)} phases"
        raise scene.error("mission", found, f"one of {phase.count}, as in the log")
    return phases[phase.number - 1]


def _split(steps: Sequence[MissionStep], whole: int) -> list[_Part]:
    """Parts of a mission whose steps are in order."""
    parts: list[_Part] = []
    waits: list[float] = []  # of the modules that are there
    for step in steps:
        if isinstance(step, InsertStep):
            modules = step.modules or whole
            if not parts or waits or (parts[-1].modules, parts[-1].depth) != (modules, step.pivot_depth):
                parts.append(_Part(modules, [], depth=step.pivot_depth))
            waits = []
            parts[-1].steps.append(step)
        elif isinstance(step, AddStep):
            if not parts or isinstance(parts[-1].steps[-1], WithdrawStep):
                waits = []
            if waits:
                parts[-1].steps.append(HoldStep(do="hold", time=step.time))
                parts[-1].stands = True
            waits.append(step.time)
            parts.append(_Part(len(waits), [step]))
        else:
            parts = parts or [_Part(whole, [])]  # an arm that hangs in the tank from the beginning
            parts[-1].steps.append(step)
            if isinstance(step, WithdrawStep):
                parts += [
                    _Part(modules, [HoldStep(do="hold", time=waits[modules]), step], stands=True)
                    for modules in range(len(waits) - 1, 0, -1)
                ]
    return parts
