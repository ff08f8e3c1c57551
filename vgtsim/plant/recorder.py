"""The recorder: the only writer of records and contacts, and the maker of the log; its clock and its thread."""

from __future__ import annotations

import importlib.metadata
import platform
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.arrays import Array, Index
from vgtsim.description import digest_scene
from vgtsim.digests import digest_code
from vgtsim.errors import CommandError
from vgtsim.graphics import mujoco
from vgtsim.log import (
    ARRAYS,
    BESIDE,
    CHUNK,
    TYPES,
    Contact,
    Piece,
    Revision,
    RunLog,
    empty_records,
    join_pieces,
    pack_contacts,
)
from vgtsim.plant.gauges import Gauges
from vgtsim.site import Site

PACKAGES = ("vgtsim", "mujoco", "numpy", "scipy", "trimesh")  # whose versions a log tells

_MOTION = 5  # records that the motion at the last one is worked out from
_SAME_STEP = 1e-6  # of a step: by which rounding may move the instant of a record


class RecordClock:
    """Tells which steps are recorded: the first one at or after each instant that a rate asks for."""

    def __init__(self, timestep: float, rate: float) -> None:
        """Begin at the first step of a time step, s, with a rate, Hz; errors are those of `set_rate`."""
        self._timestep = timestep
        self.set_rate(rate, 0)

    def set_rate(self, rate: float, steps: int) -> None:
        """Take a rate, Hz, from the coming step on, before which so many were made.

        Raises:
            CommandError: It is negative or above that of the steps.
        """
        most = 1 / self._timestep
        if not 0 <= rate <= most * (1 + _SAME_STEP):
            raise CommandError("record_rate", f"{rate:g} Hz", f"0 to {most:g} Hz, the rate of steps")
        self.rate, self._first, self._taken = rate, steps, 0

    def is_due(self, steps: int) -> bool:
        """Whether the coming step is recorded, before which so many were made; to be asked once a step."""
        due = self._taken / (self.rate * self._timestep) if self.rate else np.inf
        recorded = steps - self._first >= due - _SAME_STEP
        self._taken += recorded
        return recorded


class Courier:
    """Takes work, and does it in the order in which it is given; the thread starts with the first work.

    MuJoCo, NumPy, Arrow and the disk let other threads go on, so two cores are used where there are two.
    """

    def __init__(self) -> None:
        self._thread: ThreadPoolExecutor | None = None
        self._sent: Future[None] | None = None

    def send(self, work: Callable[[], None]) -> None:
        """Give work, once what was given before is done; an error of that is raised, and the work is not taken then."""
        self.wait()
        self._thread = self._thread or ThreadPoolExecutor(1, "log")
        self._sent = self._thread.submit(work)

    def wait(self) -> None:
        """Wait until nothing is under way; an error of the last work is raised once."""
        sent, self._sent = self._sent, None
        if sent is not None:
            sent.result()


@dataclass
class Recorder:
    """Collects records and contacts; gives them away in pieces, chunk by chunk, in a second thread.

    A piece has all arrays of a log by name. An error of the store is raised by the next record that fills a chunk, or by `wait`
    or `make_log`; nothing is given to the store after it. What follows from the motion is worked out for each piece with the
    records beside it, so a log has the same bits wherever it is kept: on disk, or here if no `store` takes the pieces.
    """

    gauges: Gauges
    store: Callable[[Piece], None] | None = None
    revisions: list[Revision] = field(default_factory=list)  # when a tour was planned anew
    _rows: dict[str, NDArray[Any]] = field(default_factory=dict)  # with room for a chunk and the records beside it
    _count: int = 0
    _given: int = 0  # of the first rows, which are kept for the motion of those after them
    _pieces: list[Piece] = field(default_factory=list)
    _contacts: list[Contact] = field(default_factory=list)  # since the last piece
    _saturated: NDArray[np.int64] | int = 0  # since the last record
    _courier: Courier = field(default_factory=Courier)

    def note_saturation(self, bits: NDArray[np.int64]) -> None:
        """Keep what a step saturated, shape (J,), for the next record."""
        self._saturated = self._saturated | bits

    def note_contacts(self, contacts: list[Contact]) -> None:
        """Add the contacts of a step."""
        self._contacts += contacts

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
        more: Mapping[str, float | Array] | None = None,
    ) -> None:
        """Add the instant at which the last step began; `mj_step` leaves positions and sensors of that instant.

        Given for that instant are the time, s, commanded lengths, shape (J,), m, what the gauges noted before the step, the
        goal approached or held (settled), the pressures of hydraulic cylinders, shape (J, 2), Pa, and more
        quantities by name.
        """
        gauges = self.gauges
        row: dict[str, Any] = {
            "time": time,
            "commanded": commanded,
            **gauges.read(data, noted),
            "tool_position": data.site_xpos[gauges.tool],
            "tool_direction": data.xmat[gauges.tip, 2::3],
            "goal": goal,
            "settled": settled,
            "saturation": self._saturated,
        }
        if pressure is not None:
            row["pressure"] = pressure
        row |= more or {}
        rows, index = self._rows, self._count
        for name, value in row.items():
            if name not in rows:
                rows[name] = _make_rows(name, value)
            rows[name][index] = value
        self._saturated, self._count = 0, index + 1
        if self._count == self._given + CHUNK + BESIDE:
            self._give()

    def axial(self, ends: Index) -> Array | None:
        """Axial forces of the members at the last record, see `RunLog.axial`; none before the first."""
        if not self._count:
            return None
        first, stop = max(self._count - _MOTION, 0), self._count
        last = {name: rows[first:stop] for name, rows in self._rows.items()}
        records = self.gauges.complete(last, slice(stop - first - 1, None))
        nodes = records["nodes"][-1]
        along = nodes[ends[:, 1]] - nodes[ends[:, 0]]
        return np.einsum("mk,mk->m", records["member_force"][-1], along) / np.linalg.norm(along, axis=1)

    def wait(self) -> None:
        """Wait until the store has taken what it was given; its error is raised."""
        self._courier.wait()

    def _give(self) -> None:
        """Give a chunk away; its rows are touched by nobody else any more."""
        part = slice(self._given, self._given + CHUNK)
        self._courier.send(partial(self._hand_over, self._stack(), part, self._contacts))
        drop = max(part.stop - BESIDE, 0)
        left = self._count - drop
        for name, rows in self._rows.items():
            kept = rows[drop : self._count]
            self._rows[name] = _make_rows(name, rows[0])
            self._rows[name][:left] = kept
        self._contacts, self._count = [], left
        self._given += CHUNK - drop

    def _hand_over(self, stacked: Piece, part: slice, contacts: list[Contact]) -> None:
        (self.store or self._pieces.append)(self._make_piece(stacked, part, contacts))

    def _stack(self) -> Piece:
        return {name: rows[: self._count] for name, rows in self._rows.items()}

    def _make_piece(self, stacked: Piece, part: slice, contacts: list[Contact]) -> Piece:
        """A part of stacked records, with contacts."""
        records: Mapping[str, NDArray[Any]] = empty_records(*self.gauges.counts)
        if stacked:
            records = self.gauges.complete(stacked, part)
        return dict(records) | pack_contacts(contacts)

    def make_log(
        self, warnings: tuple[str, ...], performance: dict[str, float], stopped: str, digests: dict[str, str]
    ) -> RunLog:
        """Make the log of all records that were not given away."""
        self.wait()
        rest = self._make_piece(self._stack(), slice(self._given, None), self._contacts)
        records: dict[str, Any] = join_pieces([*self._pieces, rest])
        return RunLog(
            **records,
            revisions=tuple(self.revisions),
            warnings=warnings,
            performance=performance,
            versions=list_versions(),
            stopped=stopped,
            digests=digests,
        )


def _make_rows(name: str, value: ArrayLike) -> NDArray[Any]:
    """Rows for as many records of a quantity as wait at once, shape (R, ...); not a number until they are told."""
    kind = ARRAYS[name][0] if name in ARRAYS else "f"
    return np.full((CHUNK + 2 * BESIDE, *np.shape(value)), np.nan if kind == "f" else 0, TYPES[kind])


@lru_cache(maxsize=1)
def _find_versions() -> tuple[tuple[str, str], ...]:
    packages = ((name, importlib.metadata.version(name)) for name in PACKAGES)
    return (("python", platform.python_version()), *packages)


def list_versions() -> dict[str, str]:
    """Version of Python and of each package that takes part, by name."""
    return dict(_find_versions())


def list_digests(site: Site) -> dict[str, str]:
    """Digests of a site's description and of this code, by name."""
    return {"description": digest_scene(site.scene), "code": digest_code()}
