"""The verbs that a study repeats: how each is done, and the figures and arrays that it finds, by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vgtsim.description import RepeatedCapacity, RepeatedRun, RepeatedWorkspace, closest
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Workspace, check_strokes, first_greatest, first_least, sample_workspace
from vgtsim.log import RunLog, empty_records
from vgtsim.planning import Tour, make_problem, plan_site, report_solution, unload_map
from vgtsim.positioning import solve_by_method, tool_goal
from vgtsim.site import Site
from vgtsim.statics import CapacityMap, draw_shapes, find_use, map_capacity
from vgtsim.verification import MEASURES, Report, verify

Figure = float | int | bool | str | None
Found = Any  # what a verb gives: each has a type of its own
Array = NDArray[Any]

_CLOCK = ("wall_s", "real_time_factor")  # of the machine, not of the case: in no table unless asked for
_FACTS = ("value", "iterations", "optimal", "stationarity", "condition number", "clearance, m", "nearest")


@dataclass(frozen=True)
class Verb:
    """What is done in a case, from a site, the settings of the work and a folder, and how names are read from its outcome."""

    do: Callable[[Site, Any, Path], Found]
    figures: Mapping[str, Callable[[Found], Figure]]
    arrays: Mapping[str, Callable[[Found], Array]]

    @property
    def extremes(self) -> tuple[str, ...]:
        """Names of the least and the greatest entry of each array."""
        return tuple(f"{end} {name}" for name in self.arrays for end in ("min", "max"))

    def choose(self, keep: tuple[str, ...], file: Path) -> tuple[str, ...]:
        """Columns that a study keeps: figures by their names or the first words of them, `min ARRAY` and `max ARRAY`.

        Raises:
            DescriptionError: The verb finds nothing of that name.
        """
        if not keep:
            return tuple(name for name in self.figures if name not in _CLOCK and not name.startswith("where "))
        chosen: dict[str, None] = {}
        names = (*self.figures, *self.extremes)
        for index, entry in enumerate(keep):
            found = [name for name in names if name == entry or name.startswith((f"{entry}: ", f"{entry}, "))]
            if not found:
                allowed = f"a figure of the verb, or min or max of an array{closest(entry, names)}"
                raise DescriptionError(file, f"keep.{index}", repr(entry), allowed)
            chosen |= dict.fromkeys(found)
        return tuple(chosen)

    def read(self, found: Found, columns: tuple[str, ...]) -> dict[str, Figure]:
        """The columns of a case; None for a check that its scene does not have, NaN where nothing in an array is finite."""
        return {
            name: self.figures[name](found) if name in self.figures else self._extreme(found, name) for name in columns
        }

    def _extreme(self, found: Found, name: str) -> float:
        end, _, array = name.partition(" ")
        values = np.asarray(self.arrays[array](found), float)
        finite = values[np.isfinite(values)]
        return float((np.min if end == "min" else np.max)(finite)) if finite.size else float("nan")


@dataclass(frozen=True)
class _Run:
    log: RunLog
    report: Report


def _run(site: Site, work: RepeatedRun, folder: Path) -> _Run:
    from vgtsim.plant import run  # MuJoCo, which the other verbs do without

    log = run(site, plan_site(site))
    report = verify(site, log)
    if work.folders:
        from vgtsim.output import write_outputs

        write_outputs(site, log, report, folder)
    return _Run(log, report)


def _row(name: str, read: Callable[[Any], Figure]) -> Callable[[_Run], Figure]:
    """How a row of the report is read; a scene may not have it."""
    return lambda run: next((read(row) for row in run.report.checks if f"{row.name}: {row.quantity}" == name), None)


def _run_verb() -> Verb:
    rows = [f"{row.check}: {row.quantity}" for row in MEASURES]
    series = ("closure", "tool_position_error", "tool_angle_error", "utilisation", "clearance")
    return Verb(
        do=_run,
        figures={"passed": lambda run: run.report.passed}
        | {name: _row(name, lambda row: float(row.measured)) for name in rows}
        | {f"where {name}": _row(name, attrgetter("where")) for name in rows}
        | {
            name: lambda run, name=name: float(run.log.performance[name])
            for name in ("simulated_s", "steps", "nv", *_CLOCK)
        },
        arrays={name: lambda run, name=name: getattr(run.log, name) for name in empty_records(1, 1, 1)}
        | {name: lambda run, name=name: run.report.series.get(name, np.empty(0)) for name in series},
    )


@dataclass(frozen=True)
class _Plan:
    site: Site
    tour: Tour

    @property
    def lengths(self) -> Array:
        """Lengths of the cylinders in every step of the tour, shape (T, J), m."""
        return np.concatenate([leg.lengths for leg in self.tour.legs])

    @property
    def q(self) -> Array:
        """Inputs at the end of each leg, shape (legs, n)."""
        return np.stack([leg.q for leg in self.tour.legs])

    @property
    def use(self) -> float:
        """Greatest use of a member or cylinder at rest at a goal."""
        site, nodes = self.site, self.site.chain.nodes(self.q)
        return float(find_use(site.load_model, site.sections, nodes, site.task.limits.safety_factor).worst.max())


def _meet_goal(site: Site, _work: object, _folder: Path) -> dict[str, Any]:
    motion = site.task.motion
    if not motion.goals:
        raise site.scene.error("motion.goals", "none: an operator drives the arm", "a goal")
    goal = motion.goals[0]
    problem = make_problem(site, tool_goal(goal.position, goal.direction), motion.method, motion.objective)
    return report_solution(site, problem, solve_by_method("ik", problem, site.start), motion.objective)


def _sample(site: Site, work: RepeatedWorkspace, _folder: Path) -> Workspace:
    check_strokes(site.chain)
    return sample_workspace(site.chain, work.samples, work.seed)


def _map(site: Site, work: RepeatedCapacity, _folder: Path) -> CapacityMap:
    chain, how = site.chain, (site.task.simulation.gravity, site.task.limits.safety_factor)
    found = map_capacity(chain, draw_shapes(chain, work.shapes, work.seed), *how, site.task.payload.mass)
    return unload_map(chain, found, *how) if work.resolve else found


def _capacity_verb() -> Verb:
    places: Iterable[tuple[str, Callable[[CapacityMap], int]]] = (
        ("at full reach", lambda found: int(first_greatest(found.radius))),
        ("least", lambda found: int(first_least(found.payload))),
    )
    figures: dict[str, Callable[[CapacityMap], Figure]] = {}
    for words, at in places:
        figures |= {
            f"payload {words}, kg": lambda found, at=at: float(found.payload[at(found)]),
            f"sag {words}, m": lambda found, at=at: float(found.sag[at(found)]),
            f"limit {words}": lambda found, at=at: f"{found.limit[at(found)]} of {found.member[at(found)]}",
        }
    return Verb(do=_map, figures=figures, arrays=_attributes("radius", "depth", "payload", "sag"))


def _attributes(*names: str) -> dict[str, Callable[[Found], Array]]:
    return {name: attrgetter(name) for name in names}


VERBS: dict[str, Verb] = {
    "run": _run_verb(),
    "plan": Verb(
        do=lambda site, _work, _folder: _Plan(site, plan_site(site)),
        figures={
            "duration, s": lambda plan: plan.tour.duration,
            "clearance, m": lambda plan: min(leg.clearance for leg in plan.tour.legs),
            "nearest": lambda plan: min(plan.tour.legs, key=lambda leg: leg.clearance).place,
            "way of an actuator, m": lambda plan: float(np.abs(np.diff(plan.lengths, axis=0)).sum(axis=0).max()),
            "stroke to spare, m": lambda plan: float(plan.site.box.spare(plan.lengths).min()),
            "use at the goals": attrgetter("use"),
        },
        arrays=_attributes("lengths", "q"),
    ),
    "ik": Verb(
        do=_meet_goal,
        figures={name: lambda told, name=name: told["facts"].get(name) for name in _FACTS}
        | {"binding": lambda told: ", ".join(told["facts"]["binding"])},
        arrays={name: lambda told, name=name: np.array(told[name]) for name in ("lengths", "q")},
    ),
    "workspace": Verb(
        do=_sample,
        figures={
            "reach, m": attrgetter("reach"),
            "volume, m³": attrgetter("volume"),
            "mobility": attrgetter("mobility"),
            "near singular": attrgetter("near_singular"),
        },
        arrays=_attributes("tool", "direction", "tilt", "dexterity", "singular"),
    ),
    "capacity": _capacity_verb(),
}
