"""How a figure of a run is measured, and the words beside it in the report. `docs/add_check.md` shows how to add one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from types import ModuleType
from typing import Literal

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.description import Limits
from vgtsim.description.figures import find_figure
from vgtsim.kinematics import first_greatest
from vgtsim.site import Site
from vgtsim.statics import MemberForces
from vgtsim.verification.evidence import Evidence

Sense = Literal["at most", "at least"]
_NAN = float("nan")


@dataclass(frozen=True)
class Finding:
    """The worst figure, NaN when it could not be measured, with its member or place and its time, s.

    `detail` says why it could not be measured, or holds more figures. Of a stretch of a long run the figure may be `absent`:
    nothing there was to be measured. What a figure is to be divided by is in `over`: the greatest of the run. The `least`
    distances, m, by their places, are added to the detail. A `summary` is what has come of the run by the last record.
    """

    value: float
    where: str = "none"
    when: float = _NAN
    detail: str = ""
    absent: bool = False
    over: float = 1.0
    least: Mapping[str, float] = field(default_factory=dict)
    summary: str = ""


@dataclass(frozen=True)
class Measure:
    """One row of the report: a figure, in words and with its unit, held against the limit of a key in the scene's `limits`.

    `applies` says whether the row is in the report of a site, and `planned` that it is only in one with a plan; `find`
    measures the figure.
    """

    check: str
    quantity: str
    unit: str
    limit: str
    sense: Sense
    applies: Callable[[Site], bool]
    planned: bool
    find: Callable[[Evidence], Finding]

    def __call__(self, run: Evidence) -> Finding:
        """Measure the figure."""
        return self.join([self.find(run)])

    def join(self, found: Sequence[Finding]) -> Finding:
        """The figure of a run, from those of its stretches: the worst one, or one that could not be measured."""
        there = [part for part in found if not part.absent] or list(found)
        sign = -1 if self.sense == "at least" else 1
        worst = max(there, key=lambda part: np.inf if np.isnan(part.value) else sign * part.value)
        over = max(there, key=lambda part: part.over)
        least = {}
        for part in there:
            least |= {place: min(value, least.get(place, np.inf)) for place, value in part.least.items()}
        detail = over.detail if over.over != worst.over else worst.detail
        detail += there[-1].summary + ", ".join(f"{place} {value:.3f} m" for place, value in least.items())
        return Finding(value=worst.value / over.over, where=worst.where, when=worst.when, detail=detail)


def find_unit(limit: str) -> str:
    """Unit of a limit by its key, "1" of parts and counts."""
    field = Limits.model_fields[limit]
    figure = find_figure(field.annotation, field.metadata)
    return "1" if figure is None or figure.unit == "dimensionless" else figure.unit


def report_as(
    check: str,
    quantity: str,
    *,
    limit: str,
    unit: str = "",
    sense: Sense = "at most",
    applies: Callable[[Site], bool] = lambda _: True,
    planned: bool = False,
) -> Callable[[Callable[[Evidence], Finding]], Measure]:
    """Make a row of the report of the function below, see `Measure`; the unit is by default that of the limit."""
    return partial(Measure, check, quantity, unit or find_unit(limit), limit, sense, applies, planned)


def report_forces(
    check: str,
    quantity: str,
    find: Callable[[Evidence, Index, MemberForces], Finding],
    *,
    moving: str = "",
    applies: Callable[[Site], bool] = lambda _: True,
) -> tuple[Measure, Measure]:
    """Two rows of an error of forces: at rest, for the settled records, and for all, inertia included.

    In the quantity `{}` stands for " at rest" or for the word for the second. The figure is found from those records, shape
    (S,), and the forces that are expected in them.
    """

    def find_error(run: Evidence, *, settled: bool) -> Finding:
        rows, expected = run.expect(settled=settled)
        return find(run, rows, expected) if len(rows) else absent("the arm never settled")

    kinds = ((True, " at rest", "axial_force_settled"), (False, moving, "axial_force_moving"))
    first, second = (
        report_as(check, quantity.format(word), limit=limit, applies=applies)(partial(find_error, settled=settled))
        for settled, word, limit in kinds
    )
    return first, second


def when(**settings: object) -> Callable[[Site], bool]:
    """Whether a scene's simulation has some settings, for example `when(drive="hydraulic")`; of a tuple, any one."""

    def applies(site: Site) -> bool:
        found = ((getattr(site.task.simulation, name), wanted) for name, wanted in settings.items())
        return all(value in wanted if isinstance(wanted, tuple) else value == wanted for value, wanted in found)

    return applies


is_imposed = when(drive="rigid", members=("rigid", "sections"))  # whether cylinders have the lengths that are commanded


def has_goals(site: Site) -> bool:
    """Whether a scene has stages to settle at the end of; an operator has none."""
    return bool(site.stages)


def has_paths(site: Site) -> bool:
    """Whether the tool follows paths."""
    return any(site.stretches)


def has_poses(site: Site) -> bool:
    """Whether a stage of the run ends in a pose of the tool."""
    return any(stage.position or stage.path for stage in site.stages)


def has_operator(site: Site) -> bool:
    """Whether an operator drives the arm of a scene."""
    return site.task.operator is not None


def has_cases(site: Site) -> bool:
    """Whether a scene has load cases."""
    return bool(site.task.loads)


def measures_in(module: ModuleType) -> list[Measure]:
    """Rows that a module defines, each named `check_...`, alone or in a tuple, in their order in the file."""
    found = [value for name, value in vars(module).items() if name.startswith("check_")]
    return [row for value in found for row in (value if isinstance(value, tuple) else (value,))]


def missing(detail: str, where: str = "none") -> Finding:
    """A figure that could not be measured, and why."""
    return Finding(value=_NAN, where=where, when=_NAN, detail=detail)


def absent(detail: str) -> Finding:
    """A figure for which a stretch has no record; why it could not be measured if no stretch has."""
    return replace(missing(detail), absent=True)


def worst_of(values: Array, time: Array, names: Sequence[str]) -> Finding:
    """Greatest of values of shape (T, M) at times (T,), s, with named columns; NaN, and its place, when any was not measured."""
    if values.size == 0:
        return missing("nothing was measured")
    gaps, detail = np.isnan(values), ""
    record, column = np.unravel_index(first_greatest(gaps if gaps.any() else values), values.shape)
    if gaps.any():
        detail = f"{gaps.any(axis=1).sum()} of {len(values)} records were not measured"
    return Finding(
        value=float(values[record, column]), where=names[int(column)], when=float(time[record]), detail=detail
    )


def least_of(values: Array, time: Array, names: Sequence[str]) -> Finding:
    """Find the least of values, as `worst_of` finds the greatest."""
    worst = worst_of(-values, time, names)
    return Finding(value=-worst.value, where=worst.where, when=worst.when, detail=worst.detail)
