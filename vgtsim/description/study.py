"""A study: one verb repeated over cases of a scene, which are a grid, a sample or a list, and what is kept of each case.

The keys of a case are dotted paths into the scene, its arm, its tank or the work, such as `scene.payload.mass`,
`scene.motion.goals.heel.position.2`, `arm.tubes.t200x125.wall` or `work.seed`. An entry of a list goes by its index or name.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from vgtsim.description.scene import Scene
from vgtsim.description.schema import Description, Name


class Repeated(Description):
    """The work of every case: plan the tour; or meet the first goal of the tour, from the start (`ik`)."""

    verb: Literal["plan", "ik"]


class RepeatedRun(Description):
    """Plan, run and verify the scene.

    Attributes:
        folders: Whether each run also leaves its folder; on a cluster all workers must see its disk.
    """

    verb: Literal["run"]
    folders: bool = False


class RepeatedWorkspace(Description):
    """Sample the workspace of the scene's arm.

    Attributes:
        samples: Number of poses.
        seed: Of the sample.
    """

    verb: Literal["workspace"]
    samples: int = Field(default=5000, ge=10)
    seed: int


class RepeatedCapacity(Description):
    """Map the allowable payload of the scene's arm.

    Attributes:
        shapes: Number of poses that are drawn.
        seed: Of the draw.
        resolve: Whether the governing member is unloaded in every cell of the map.
    """

    verb: Literal["capacity"]
    shapes: int = Field(default=20000, ge=10)
    seed: int
    resolve: bool = False


Work = Annotated[Repeated | RepeatedRun | RepeatedWorkspace | RepeatedCapacity, Field(discriminator="verb")]
VERBS = ("run", "plan", "ik", "workspace", "capacity")

_Figure = float | str  # a number, or a quantity with its unit


class Span(Description):
    """Figures evenly spaced between two ends, both included.

    Attributes:
        least: First figure, a number or a quantity.
        greatest: Last figure.
        count: Number of figures, in a grid; a sample has none, it draws between the two.
    """

    least: _Figure
    greatest: _Figure
    count: int | None = Field(default=None, ge=2)


def _kind_of_axis(entry: Any) -> str:
    return "span" if isinstance(entry, dict | Span) else "values"


Axis = Annotated[
    Annotated[tuple[Any, ...], Field(min_length=1), Tag("values")] | Annotated[Span, Tag("span")],
    Discriminator(_kind_of_axis),
]
AXES = ("values", "span")


def _flatten(node: Any) -> Any:
    """Nested tables of TOML as one table of dotted keys: quoted keys and bare ones are the same."""

    def walk(table: Mapping[str, Any], above: str) -> Iterator[tuple[str, Any]]:
        for key, entry in table.items():
            if isinstance(entry, Mapping) and "least" not in entry and "greatest" not in entry:
                yield from walk(entry, f"{above}{key}.")
            else:
                yield above + key, entry

    return dict(walk(node, "")) if isinstance(node, Mapping) else node


class Sample(Description):
    """A seeded sample of cases.

    Attributes:
        method: How it is drawn.
        count: Number of cases.
        seed: Of the sample.
        over: Keys, as in `grid`; each takes a figure of its span, or one of its values.
    """

    method: Literal["uniform", "latin_hypercube", "sobol"]
    count: int = Field(ge=1)
    seed: int = Field(ge=0)
    over: Annotated[dict[str, Axis], BeforeValidator(_flatten), Field(min_length=1)]


class StudyFile(Description):
    """A study as written.

    Attributes:
        scene: Shipped name of a scene, or its path relative to the study's file.
        work: The verb that every case repeats.
        sample: A seeded sample of cases in the place of a grid.
        keep: Columns of the table: names of figures, or `min ARRAY` and `max ARRAY`; all figures if empty.
        grid: Every combination of the values of its keys, the last key fastest. A key is a dotted path into the scene, its
            arm, its tank or the work, such as `scene.payload.mass`; it has a span or a list of values.
        cases: A list of cases: tables of such keys with one value each, the same keys in all of them.
    """

    name: Name
    title: str = ""
    scene: str
    work: Work
    keep: tuple[str, ...] = ()
    grid: Annotated[dict[str, Axis], BeforeValidator(_flatten)] = Field(default_factory=dict)
    sample: Sample | None = None
    cases: tuple[Annotated[dict[str, Any], BeforeValidator(_flatten)], ...] = ()

    @model_validator(mode="after")
    def _one_kind_of_cases(self) -> StudyFile:
        given = [name for name in ("grid", "sample", "cases") if getattr(self, name)]
        if len(given) != 1:
            raise ValueError(f"one of [grid], [sample] and [[cases]], not {' and '.join(given) or 'none'}")
        axes = {f"grid.{key}": (axis, True) for key, axis in self.grid.items()}
        if self.sample:
            axes = {f"sample.over.{key}": (axis, False) for key, axis in self.sample.over.items()}
        for place, (axis, counted) in axes.items():
            if isinstance(axis, Span) and (axis.count is not None) != counted:
                raise ValueError(f"{place}: a span of a {'grid has a count' if counted else 'sample has no count'}")
        for index, case in enumerate(self.cases):
            if set(case) != set(self.cases[0]):
                raise ValueError(f"cases.{index}: the keys of the first case, {', '.join(self.cases[0])}")
        return self


@dataclass(frozen=True)
class Study:
    """A study's file with the scene that it names."""

    task: StudyFile
    scene: Scene
    file: Path
