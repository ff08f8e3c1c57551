"""The recorder: the only writer of records and contacts, and the maker of the log."""

from __future__ import annotations

import importlib.metadata
import platform
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vgtsim.graphics import mujoco
from vgtsim.plant.gauges import Gauges
from vgtsim.plant.watch import Contact
from vgtsim.runlog import RunLog, empty_records

Array = NDArray[np.float64]

PACKAGES = ("vgtsim", "mujoco", "numpy", "scipy", "trimesh")  # whose versions a log tells
_MAX_CONTACTS = 1000  # of one run; a collision under rigid drives ends it long before


@dataclass
class Recorder:
    """Collects records, one list a quantity, and the first thousand contacts; stacks them when a log is asked for."""

    gauges: Gauges
    records: dict[str, list[Any]] = field(default_factory=dict)
    contacts: list[Contact] = field(default_factory=list)
    _saturated: NDArray[np.int64] | int = 0

    def note_saturation(self, bits: NDArray[np.int64]) -> None:
        """Keep what a step saturated, shape (J,), for the next record."""
        self._saturated = self._saturated | bits

    def note_contacts(self, contacts: list[Contact]) -> None:
        """Add the contacts of a step."""
        self.contacts += contacts[: _MAX_CONTACTS - len(self.contacts)]

    def record(
        self,
        data: mujoco.MjData,
        *,
        time: float,
        commanded: Array,
        noted: Array,
        goal: int,
        settled: bool,
        pressure: Array | None = None,
    ) -> None:
        """Add the instant at which the last step began; `mj_step` leaves positions and sensors of that instant.

        Given for that instant are the time, s, commanded lengths, shape (J,), m, what the gauges noted before the step, the
        goal approached or held (settled), and the pressures of hydraulic cylinders, shape (J, 2), Pa.
        """
        gauges = self.gauges
        row = {
            "time": time,
            "commanded": commanded,
            **gauges.read(data, noted),
            "tool_position": data.site_xpos[gauges.tool].copy(),
            "tool_direction": data.xmat[gauges.tip].reshape(3, 3)[:, 2].copy(),
            "goal": goal,
            "settled": settled,
            "saturation": self._saturated | np.zeros(len(commanded), dtype=np.int64),
        }
        if pressure is not None:
            row["pressure"] = pressure
        for name, value in row.items():
            self.records.setdefault(name, []).append(value)
        self._saturated = 0

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Stack the records: quantity to array, records along the first axis."""
        if not self.records:
            return empty_records(*self.gauges.counts)
        return dict(self.gauges.complete({name: np.array(values) for name, values in self.records.items()}))

    def make_log(
        self, warnings: tuple[str, ...], performance: dict[str, float], stopped: str, digests: dict[str, str]
    ) -> RunLog:
        """Make the log of all records so far."""
        touched = self.contacts
        return RunLog(
            **self.arrays(),
            contact_time=np.array([contact.time for contact in touched], dtype=float),
            contact_pair=np.array([contact[1:3] for contact in touched], dtype=str).reshape(-1, 2),
            contact_distance=np.array([contact.gap for contact in touched], dtype=float),
            warnings=warnings,
            performance=performance,
            versions=dict(_list_versions()),
            stopped=stopped,
            digests=digests,
        )


@lru_cache(maxsize=1)
def _list_versions() -> tuple[tuple[str, str], ...]:
    """Name and version of Python and of each package that takes part."""
    packages = ((name, importlib.metadata.version(name)) for name in PACKAGES)
    return (("python", platform.python_version()), *packages)
