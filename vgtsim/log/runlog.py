"""The run log: what the step loop saw, as whole arrays.

It stands apart from the simulation so that verification can read it without MuJoCo.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import nan
from typing import Annotated, Any, NamedTuple, get_type_hints

import numpy as np
from numpy.typing import NDArray

from vgtsim.arrays import Array, Index, Mask

Piece = Mapping[str, NDArray[Any]]  # arrays of a log by name, records along the first axis

# records that a log takes at once: four seconds of a shipped scene; a kill loses no more than these and those being written
CHUNK = 100
BESIDE = 6  # records on either side of one that its acceleration is made of, at the ends of a stretch of even spacing
_LEAST_RECORDS = 5  # for accelerations from positions
FEED = ("feed", "feed_commanded", "feed_force")
TURN = ("turn", "turn_commanded", "turn_torque")
CUTTING = ("tool_share", "tool_force", "removed", "bed")
MAY_BE_EMPTY = (
    "saturation",
    "pressure",
    "target",
    *FEED,
    *TURN,
    *CUTTING,
    "acceleration",
    "contact_force",
    "contact_point",
)


@dataclass(frozen=True)
class Revision:
    """An instant at which what appeared in the tank made a tour be planned anew: its time, s, and row of the leg of an index."""

    time: float
    leg: int
    row: int


class Contact(NamedTuple):
    """Two geoms that touch: when, s, which, their gap, negative in penetration, m, the force on the arm, N, and where, m.

    Of two parts of the arm the force is that on the second one. It is not known where lengths are imposed.
    """

    time: float
    first: str
    second: str
    gap: float
    force: tuple[float, ...] = (nan,) * 3
    point: tuple[float, ...] = (nan,) * 3


@dataclass(frozen=True)
class RunLog:
    """Records of one run; T records, N nodes, M members, J actuators, C contacts.

    Times have shape (T,) and (C,), s. Vectors are in frame G.

    Attributes:
        nodes: Hub positions, shape (T, N, 3), m.
        ends: Positions of the members' own ends, near end first, shape (T, M, 2, 3), m.
        commanded, actual: Actuator lengths asked for and reached, shape (T, J), m.
        rates: Actuator speeds, shape (T, J), m/s.
        member_force, member_moment: Force and moment of each member on the hub at its near end, shape (T, M, 3), N, N·m.
        actuator_force: Force of each drive on its rod, tension positive, shape (T, J), N.
        mast_reaction: Force and moment of the mast on the arm at the pivot, shape (T, 6), N and N·m.
        tool_position, tool_direction: Tool point, m, and unit normal of the tip plate, shape (T, 3).
        goal: Goal being approached or held, shape (T,); -1 before the first.
        settled: True while a goal is held after settling, shape (T,).
        contact_pair: Names of the two geoms, shape (C, 2).
        contact_distance: Gap, negative in penetration, shape (C,), m.
        acceleration: Of the nodes, by the places of three steps, shape (T, N, 3), m/s²; only in logs of missions and of
            scenes that allow contacts, as records are too far apart to tell it where a quick move ends or something knocks.
        contact_force: Force on the arm, of two of its parts on the second one, shape (C, 3), N; NaN where lengths are imposed.
        contact_point: Where it acts, shape (C, 3), m. Both are empty in logs of versions that did not tell.
        warnings: Warnings of MuJoCo.
        performance: `simulated_s`, `wall_s`, `real_time_factor`, `steps`, `nv`.
        versions: Version of Python and of each package, by name.
        pressure: Above the tank's on the bore's and the rod's side of each hydraulic cylinder, shape (T, J, 2), Pa; empty
            under other drives.
        stopped: Why the run ended early, or an empty string.
        digests: Of the `description` (scene, arm and tank), the `programme` (the timed lengths of a tour) and the `code` of
            this package; empty in logs of versions that made none.
        revisions: When the tour was planned anew; empty in most runs.
        saturation: What each cylinder had reached since the record before, bits of 1 flow or speed, 2 force or
            pressure, 4 stroke and 8 cavity, shape (T, J); empty in logs of versions that did not look.
        target: Where an operator wanted the tool: position, m, and direction, shape (T, 6); empty in other runs.
        feed, feed_commanded: Height of the mast above its working depth, reached and asked for, shape (T,), m; empty in logs
            of versions that held it there.
        feed_force: Force of the hoist on the mast, upward, shape (T,), N; empty as the feed.
        turn, turn_commanded: Of the mast about its axis, reached and asked for, shape (T,), rad; these and the torque of its
            drive on it, `turn_torque`, N·m, are only in logs of scenes whose mast turns.
        tool_share: Of the tool's full power, at which it removes waste, 0 to 1, shape (T,). This and the next three are only in
            logs of missions that cut.
        tool_force: Of the waste on the tool point, shape (T, 3), N.
        removed: Volume of waste removed so far, shape (T,), m³.
        bed: Heights of the waste where it may be cut, in the order of the site's diggings, shape (T, P), m.
    """

    time: Annotated[Array, "f", "T"]
    nodes: Annotated[Array, "f", "TN3"]
    ends: Annotated[Array, "f", "TM23"]
    commanded: Annotated[Array, "f", "TJ"]
    actual: Annotated[Array, "f", "TJ"]
    rates: Annotated[Array, "f", "TJ"]
    member_force: Annotated[Array, "f", "TM3"]
    member_moment: Annotated[Array, "f", "TM3"]
    actuator_force: Annotated[Array, "f", "TJ"]
    mast_reaction: Annotated[Array, "f", "T6"]
    tool_position: Annotated[Array, "f", "T3"]
    tool_direction: Annotated[Array, "f", "T3"]
    goal: Annotated[NDArray[np.int64], "i", "T"]
    settled: Annotated[Mask, "b", "T"]
    contact_time: Annotated[Array, "f", "C"]
    contact_pair: Annotated[NDArray[np.str_], "U", "C2"]
    contact_distance: Annotated[Array, "f", "C"]
    warnings: tuple[str, ...]
    performance: dict[str, float]
    versions: dict[str, str]
    stopped: str = ""
    digests: dict[str, str] = field(default_factory=dict)
    revisions: tuple[Revision, ...] = ()
    saturation: Annotated[NDArray[np.int64], "i", "TJ"] = field(default_factory=lambda: np.zeros((0, 0), np.int64))
    pressure: Annotated[Array, "f", "TJ2"] = field(default_factory=lambda: np.zeros((0, 0, 2)))
    target: Annotated[Array, "f", "T6"] = field(default_factory=lambda: np.zeros((0, 6)))
    acceleration: Annotated[Array, "f", "TN3"] = field(default_factory=lambda: np.zeros((0, 0, 3)))
    contact_force: Annotated[Array, "f", "C3"] = field(default_factory=lambda: np.zeros((0, 3)))
    contact_point: Annotated[Array, "f", "C3"] = field(default_factory=lambda: np.zeros((0, 3)))
    feed: Annotated[Array, "f", "T"] = field(default_factory=lambda: np.zeros(0))
    feed_commanded: Annotated[Array, "f", "T"] = field(default_factory=lambda: np.zeros(0))
    feed_force: Annotated[Array, "f", "T"] = field(default_factory=lambda: np.zeros(0))
    turn: Annotated[Array, "f", "T"] = field(default_factory=lambda: np.zeros(0))
    turn_commanded: Annotated[Array, "f", "T"] = field(default_factory=lambda: np.zeros(0))
    turn_torque: Annotated[Array, "f", "T"] = field(default_factory=lambda: np.zeros(0))
    tool_share: Annotated[Array, "f", "T"] = field(default_factory=lambda: np.zeros(0))
    tool_force: Annotated[Array, "f", "T3"] = field(default_factory=lambda: np.zeros((0, 3)))
    removed: Annotated[Array, "f", "T"] = field(default_factory=lambda: np.zeros(0))
    bed: Annotated[Array, "f", "TP"] = field(default_factory=lambda: np.zeros((0, 0)))

    def __post_init__(self) -> None:
        for name in ARRAYS:
            getattr(self, name).flags.writeable = False

    @property
    def count(self) -> int:
        """Number of records."""
        return len(self.time)

    @property
    def height(self) -> Array:
        """Of the mast above its working depth, shape (T,), m; zero in a log without a feed."""
        return self.feed if self.feed.size else np.zeros(len(self.time))

    @property
    def turned(self) -> Array:
        """Turn of the mast, shape (T,), rad; zero in a log without one."""
        return self.turn if self.turn.size else np.zeros(len(self.time))

    def read(self, first: int, stop: int, every: int = 1) -> RunLog:
        """The records from one to before another, or every so many of them, with all contacts."""
        arrays = {name: getattr(self, name) for name, (_, sizes) in ARRAYS.items() if sizes[0] == "T"}
        return replace(self, **{name: value[first:stop:every] for name, value in arrays.items()})

    def find_fault(self) -> str:
        """Say which quantity is not finite or has another number of records, or that records are too few or not evenly spaced.

        Empty when nothing is wrong.
        """
        count = len(self.time)
        for name, (_, sizes) in ARRAYS.items():
            value = getattr(self, name)
            if sizes[0] != "T" or (name in MAY_BE_EMPTY and not value.size):
                continue
            if len(value) != count:
                return f"{name} has {len(value)} records, time has {count}"
            if wrong := int(np.sum(~np.isfinite(value.reshape(count, -1)).all(axis=1))):
                return f"{name} is not finite in {wrong} records"
        step = np.diff(self.time)
        if count < _LEAST_RECORDS:
            return f"{count} records; at least {_LEAST_RECORDS}"
        if step.min() <= 0 or np.ptp(step) > 1e-6 * step.max():  # rounding of times apart
            return f"records are {step.min():.6g} to {step.max():.6g} s apart; evenly spaced ones can be differenced"
        return ""

    def find_misfit(self, nodes: int, members: int, actuators: int, goals: int, heights: int = 0) -> str:
        """Say which array does not fit the counts of an arm, or that a goal is none of the scene's; empty when all fits."""
        counts = {"T": len(self.time), "N": nodes, "M": members, "J": actuators, "C": len(self.contact_time)}
        counts["P"] = heights
        for name, (_, sizes) in ARRAYS.items():
            value, wanted = getattr(self, name), _read_shape(sizes, counts)
            if value.shape != wanted and not (name in MAY_BE_EMPTY and not value.size):
                return f"{name} has shape {value.shape}, that of the scene's arm is {wanted}"
        low, high = (self.goal.min(), self.goal.max()) if len(self.goal) else (-1, -1)
        if low < -1 or high >= goals:
            return f"goals {low} to {high} are in the log; allowed: -1 to {goals - 1}, as the scene has {goals}"
        return ""

    def directions(self, ends: Index) -> Array:
        """Unit vectors along members, from near to far hub, shape (T, M, 3); `ends` are their nodes, shape (M, 2)."""
        span = self.nodes[:, ends[:, 1]] - self.nodes[:, ends[:, 0]]
        return span / np.linalg.norm(span, axis=-1, keepdims=True)

    def axial(self, ends: Index) -> Array:
        """Axial member forces at the near ends, tension positive, shape (T, M), N; `ends` as in `directions`."""
        return np.einsum("tmk,tmk->tm", self.member_force, self.directions(ends))

    def shear(self) -> Array:
        """Forces across the members at the near ends, shape (T, M, 3), N, in frame G.

        They are across the axes of the members themselves. Across the line between its hubs a member whose far end is a
        micrometre off would shear by a millionth of its axial force.
        """
        axis = self.ends[:, :, 1] - self.ends[:, :, 0]
        axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
        return self.member_force - np.sum(self.member_force * axis, axis=-1, keepdims=True) * axis


# kind and shape of each array, the latter in the letters of `RunLog`
ARRAYS: dict[str, tuple[str, str]] = {
    name: hint.__metadata__
    for name, hint in get_type_hints(RunLog, include_extras=True).items()
    if hasattr(hint, "__metadata__")
}
TYPES = {"f": np.dtype(np.float64), "i": np.dtype(np.int64), "b": np.dtype(np.bool_)}  # of arrays, by kind


def _read_shape(sizes: str, counts: Mapping[str, int]) -> tuple[int, ...]:
    return tuple(counts[size] if size in counts else int(size) for size in sizes)


def empty_records(nodes: int, members: int, actuators: int) -> dict[str, NDArray[Any]]:
    """Arrays of a log without any record, by name, contacts apart."""
    counts = {"T": 0, "N": nodes, "M": members, "J": actuators, "P": 0}
    records = {name: form for name, form in ARRAYS.items() if form[1][0] == "T"}
    return {name: np.zeros(_read_shape(sizes, counts), dtype=TYPES[kind]) for name, (kind, sizes) in records.items()}


def join_pieces(pieces: Sequence[Piece]) -> dict[str, NDArray[Any]]:
    """One array a quantity of pieces that follow one another, of the quantities that the first one has."""
    return {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}


def pack_contacts(contacts: Sequence[Contact]) -> dict[str, NDArray[Any]]:
    """The arrays of a log that tell of contacts, by name."""
    return {
        "contact_time": np.array([contact.time for contact in contacts], dtype=float),
        "contact_pair": np.array([contact[1:3] for contact in contacts], dtype=str).reshape(-1, 2),
        "contact_distance": np.array([contact.gap for contact in contacts], dtype=float),
        "contact_force": np.array([contact.force for contact in contacts], dtype=float).reshape(-1, 3),
        "contact_point": np.array([contact.point for contact in contacts], dtype=float).reshape(-1, 3),
    }
