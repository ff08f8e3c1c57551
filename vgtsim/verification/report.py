"""Verdicts as data: checks with figures and limits, and the report that holds them; all rows in their order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vgtsim.arrays import Array
from vgtsim.site import Site
from vgtsim.verification import clamp, cutting, drives, hoist, members, record, shape, space, tracking
from vgtsim.verification.measures import Finding, Sense, find_unit, measures_in

_FILES = (record, shape, tracking, members, drives, space, hoist, clamp, cutting)
_EACH = [measure for file in _FILES for measure in measures_in(file)]  # as they stand in their files
CHECK_NAMES = tuple(dict.fromkeys(measure.check for measure in _EACH))
MEASURES = tuple(sorted(_EACH, key=lambda measure: CHECK_NAMES.index(measure.check)))  # rows of one name together


@dataclass(frozen=True)
class Check:
    """One figure against its limit: measured, and NaN when the check could not be made.

    Attributes:
        name: One of `CHECK_NAMES`; a check with two figures stands in two rows.
        quantity: The measured quantity in words.
        unit: Of the figure and its limit.
        where: Worst member or place.
        when: Time of the worst figure, s; NaN when there is none.
        source: Where the limit comes from.
        detail: Why the check could not be made, or more figures.
    """

    name: str
    quantity: str
    measured: float
    limit: float
    unit: str
    sense: Sense
    where: str
    when: float
    source: str
    detail: str = ""

    @property
    def passed(self) -> bool:
        """Whether the figure is within its limit; a check that could not be made is not."""
        if not np.isfinite(self.measured):
            return False
        return self.measured <= self.limit if self.sense == "at most" else self.measured >= self.limit


@dataclass(frozen=True)
class Report:
    """All checks of a run, in the order of `CHECK_NAMES`.

    Attributes:
        performance: `simulated_s`, `wall_s`, `real_time_factor`, `steps`, `nv`.
        versions: Version of each package that took part.
        notes: What a reader must know beside the figures: limits, description, programme or code that are not the run's.
        series: Figures over time for plots; keys `closure` (T,) m, `tool_position_error` (T,) m and `tool_angle_error`
            (T,) rad (NaN where no goal is approached), `utilisation` (T, M) and its parts `utilisation_tension` and
            `utilisation_compression` (T, M), `clearance_time` (K,) s and `clearance` (K,) m.
        phases: The reports of a mission's phases, of which this one has the worst figures; empty in any other.
    """

    scene: str
    checks: tuple[Check, ...]
    performance: Mapping[str, float]
    versions: Mapping[str, str]
    series: Mapping[str, Array] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    phases: tuple[Report, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether every check passed and none is missing."""
        return {check.name for check in self.checks} == set(CHECK_NAMES) and all(check.passed for check in self.checks)

    def to_dict(self) -> dict[str, Any]:
        """Return what `report.json` holds; figures that are not finite become null."""
        names = "name quantity measured limit sense unit passed where when source detail"
        rows = [{name: getattr(check, name) for name in names.split()} for check in self.checks]
        for row in rows:
            row |= {name: float(row[name]) if np.isfinite(row[name]) else None for name in ("measured", "when")}
        performance = {name: value if np.isfinite(value) else None for name, value in self.performance.items()}
        figures = {"performance": performance, "versions": dict(self.versions)}
        head = {"scene": self.scene, "passed": self.passed, "notes": list(self.notes)}
        phases = {"phases": [report.to_dict() for report in self.phases]} if self.phases else {}
        return head | {"checks": rows} | figures | phases


def judge(
    site: Site, name: str, quantity: str, limit: str, found: Finding, *, unit: str = "", sense: Sense = "at most"
) -> Check:
    """Hold a figure against the limit of a key in the scene's `limits`, whose unit it has by default."""
    origin = site.task.provenance.get(f"limits.{limit}")
    return Check(
        name=name,
        quantity=quantity,
        measured=found.value,
        limit=float(getattr(site.task.limits, limit)),
        unit=unit or find_unit(limit),
        sense=sense,
        where=found.where,
        when=found.when,
        source=f"{origin.label}: {origin.note}" if origin else f"{site.scene.file.name}: limits.{limit}",
        detail=found.detail,
    )
