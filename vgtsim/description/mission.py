"""A mission: the steps of an arm's work in a tank, from above the riser and back, each a stage of one run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees
from typing import Annotated, Any, Literal

from pydantic import Field, GetJsonSchemaHandler
from pydantic_core import CoreSchema

from vgtsim.description.figures import Angle, Length, Size, Speed, Tolerance, Wait
from vgtsim.description.schema import Description, Name
from vgtsim.description.tool_path import ToolPath


class InsertStep(Description):
    """The arm comes from above the riser to its working depth, on a way that the program finds.

    Attributes:
        modules: Active modules of a shorter arm, counted from the tool; absent for the whole arm.
        pivot_depth: Depth of the arm's base face below the crown at which it works until it is withdrawn; absent, the mast's.
    """

    do: Literal["insert"]
    modules: int | None = Field(default=None, ge=1, le=100)
    pivot_depth: Size | None = None


class AddStep(Description):
    """An active module, with the static sections below it, is set on the arm above ground, and all is lowered by its length.

    The first one is that of the tool. The part below stands in the tank's clamp meanwhile; after the last one the arm goes
    down to its working depth. The arm leaves the tank as it came, module by module.

    Attributes:
        time: How long the part below stands in the clamp while the module is set on, or taken off.
    """

    do: Literal["add_module"]
    time: Wait


class MoveStep(Description):
    """The tool goes to a goal of the scene, by its name.

    Attributes:
        goal: Name of a goal in `motion.goals`.
        turn: Of the mast at the goal; absent, it stays as it is. The arm keeps its shape while the mast turns, before or after
            the way. A withdrawal turns the mast back.
    """

    do: Literal["move"]
    goal: Name
    turn: Angle | None = None


class RasterStep(Description):
    """The tool runs rows to and fro over a parallelogram that begins at the tool, as a raster of a tool path.

    Attributes:
        width: Along a row.
        depth: Across all rows.
        rows: Number of rows.
        tolerance: Greatest distance of the tool from the rows, m, and of its direction, rad.
        direction: The tool keeps the direction that it has before (`kept`), or points as the arm likes (`free`).
    """

    do: Literal["raster"]
    width: tuple[Length, Length, Length]
    depth: tuple[Length, Length, Length]
    rows: int = Field(ge=2, le=1000)
    tolerance: Tolerance = 1e-4
    direction: Literal["kept", "free"] = "kept"


class CutStep(Description):
    """The tool removes a layer of waste from a patch, in rows to and fro.

    The rows are level: the tool cuts no deeper than its reach, so the layer's bottom is level too.

    Attributes:
        patch: Name of one of the `patches`.
        depth: Of the layer, below the highest place of the patch as it is then.
        rows: Number of rows.
        speed: Greatest speed of the tool; absent for that at which it can remove the whole layer in one pass.
        tolerance: Greatest distance of the tool from the rows, m, and of its direction, rad.
        direction: The tip plate keeps the direction that it has before (`kept`), or points as the arm likes (`free`): what cuts
            hangs plumb in any case. Free, the rows need no `move` before them, and an arm of one module can run them.
    """

    do: Literal["cut"]
    patch: Name
    depth: Size
    rows: int = Field(ge=2, le=1000)
    speed: Speed | None = None
    tolerance: Tolerance = 1e-4
    direction: Literal["kept", "free"] = "kept"


class _OrFile:
    """The table of a path, or the name of its file, in whose place the loader puts the table."""

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Either of both."""
        return {"anyOf": [handler(schema), {"type": "string"}]}


class FollowStep(Description):
    """The tool goes to the beginning of a path, and along it.

    Attributes:
        path: A tool path: its file, relative to the scene's, or a shipped one by name; or the path itself as a table.
    """

    do: Literal["follow"]
    path: Annotated[ToolPath, _OrFile()]


class HoldStep(Description):
    """The arm stands still for a `time`.

    Attributes:
        time: How long.
    """

    do: Literal["hold"]
    time: Wait


class WithdrawStep(Description):
    """The arm goes back to where it was inserted, and out through the riser."""

    do: Literal["withdraw"]


MissionStep = Annotated[
    InsertStep | AddStep | MoveStep | RasterStep | CutStep | FollowStep | HoldStep | WithdrawStep,
    Field(discriminator="do"),
]


@dataclass(frozen=True)
class RunStage:
    """A stage of a run and the tool pose to hold at its end, in frame G; a stage without one ends where its way ends.

    A path that the tool follows ends in the pose of its own end.
    """

    name: str
    position: tuple[float, float, float] | None = None
    direction: tuple[float, float, float] | None = None
    path: ToolPath | None = None


def begins_inside(steps: Sequence[MissionStep]) -> bool:
    """Whether the arm of a mission hangs in the tank from the beginning: no step brings it in or out."""
    return not any(isinstance(step, InsertStep | AddStep | WithdrawStep) for step in steps)


def find_stray_turn(steps: Sequence[MissionStep], allowed: tuple[float, float] | None) -> tuple[str, str, str] | None:
    """First turn, as `find_disorder` gives it, that the mast does not make, whose range is allowed, rad; None without one."""
    for index, step in enumerate(steps):
        if not isinstance(step, MoveStep) or step.turn is None:
            continue
        if allowed is None:
            return f"{index}.turn", f"{step.turn:g} rad", "nothing: there is no mast.turn"
        if not allowed[0] <= step.turn <= allowed[1]:
            found = f"{step.turn:.4g} rad, {degrees(step.turn):.4g} degrees"
            return f"{index}.turn", found, f"{allowed[0]:.4g} to {allowed[1]:.4g} rad, the range of mast.turn"
    return None


def find_disorder(
    steps: Sequence[MissionStep], goals: Sequence[str], modules: int, *, fed: bool = True
) -> tuple[int, str, str] | None:
    """First step that cannot be carried out after those before it: its index, what it is and what is allowed; None without.

    The whole arm has a number of active modules. One whose mast is not fed hangs in the tank if no step brings it in or out.
    """
    there, growing, posed = 0 if fed or not begins_inside(steps) else modules, False, False
    for index, step in enumerate(steps):
        if isinstance(step, InsertStep):
            if there:
                return index, "insert while the arm is in the tank", "withdraw first"
            if (step.modules or 0) > modules:
                return index, f"insert of {step.modules} modules", f"at most {modules}, those of the whole arm"
            there, posed = step.modules or modules, False
            continue
        if isinstance(step, AddStep):
            if there and not growing:
                return index, f"add_module to an arm of {there} modules that is at work", "withdraw first"
            if there == modules:
                return index, f"add_module to the whole arm, which has {modules}", f"at most {modules} of them"
            there, growing, posed = there + 1, True, False
            continue
        if not there:
            return index, f"{step.do} while the arm is above the riser", "insert or add_module first"
        growing = False
        if isinstance(step, MoveStep):
            if step.goal not in goals:
                return index, f"move to {step.goal!r}", f"a goal of the scene: {', '.join(goals)}"
            posed = True
        elif isinstance(step, FollowStep):
            posed = True
        elif isinstance(step, RasterStep | CutStep):
            free = isinstance(step, CutStep) and step.direction == "free"
            if not posed and not free:
                allowed = "move to a goal first: the rows begin there, or near it"
                return index, f"{step.do} from where the insertion ends", allowed
        elif isinstance(step, WithdrawStep):
            there = 0
    return None
