"""Goal spaces: which rows a configuration must meet, at the tool or at any face of the arm (section 5.1)."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from functools import lru_cache
from math import prod
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index
from vgtsim.errors import GoalError
from vgtsim.kinematics import Chain, State
from vgtsim.positioning import rows

_FARTHEST = 1e9  # m: no arm asks for a goal beyond it, and squares and cubes of it are exact enough

TOLERANCE = 1e-9  # m and rad: far below what a drive can do, and within reach of Newton's last step
_AXES = "xyz"


class Rows:
    """A group of rows about the tool or about the top face of a module."""

    target: Array
    module: str | None
    tolerance: float

    kind = rows.POSITION
    columns: tuple[int, ...] = ()
    _target_axes = 1  # of the target of one goal

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """One for each row."""

    @property
    def width(self) -> int:
        """Number of rows."""
        return {rows.POSITION: len(self.columns), rows.DIRECTION: 2, rows.TURN: 3}[self.kind]

    @property
    def count(self) -> int:
        """Number of goals."""
        return prod(self.target.shape[: self.target.ndim - self._target_axes])

    def targets(self, which: Index) -> Array:
        """Targets of some goals, shape (b, 3) or (b, 3, 3)."""
        every = self.target.reshape(-1, *self.target.shape[self.target.ndim - self._target_axes :])
        return every[which if len(every) > 1 else np.zeros_like(which)]

    def fill(self, targets: Array) -> None:
        """Write the targets into a table, shape (G, 3, 3)."""
        targets[:, 0] = self.target

    def choose(self, which: Index) -> Self:
        """The same rows for some of the goals; one target for all stays one."""
        single = self.target.ndim == self._target_axes or len(self.target) == 1
        return self if single else replace(self, target=self.target[which])  # type: ignore[type-var]

    def place(self, chain: Chain) -> tuple[int, int]:
        """The face, and the number of inputs of the active modules before it."""
        modules, layout = chain.manipulator.modules, chain.layout
        if self.module is None:
            return len(modules), layout.inputs
        names = [module.name for module in modules]
        if self.module not in names:
            raise GoalError(self.names, 0.0, f"no module {self.module!r}; modules: {', '.join(names)}")
        face = names.index(self.module) + 1
        return face, int(np.searchsorted(layout.owner, layout.face_from[face]))

    def offset(self, chain: Chain) -> float:
        """Distance of the point meant from its face, m: the tool point stands off the tip plate."""
        return chain.manipulator.tip_plate.tool_offset if self.module is None else 0.0


@dataclass(frozen=True)
class Position(Rows):
    """A point of the arm is at a target in G, shape (..., 3), m, along some of the axes; the tolerance is in m.

    The point is the centroid of a module's top face, or the tool point without a module.
    """

    target: Array
    axes: str = "xyz"
    module: str | None = None
    tolerance: float = TOLERANCE

    @property
    def names(self) -> tuple[str, ...]:
        """One for each axis."""
        return tuple(f"{self.module or 'tool'} {axis}" for axis in self.axes)

    @property
    def columns(self) -> tuple[int, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Which coordinates of the point count."""
        return tuple(_AXES.index(axis) for axis in self.axes)


@dataclass(frozen=True)
class Direction(Rows):
    """The normal of a face has a unit direction in G, shape (..., 3): rows 2 tan(theta / 2) about two axes across it.

    The face is the top face of a module, or the tip plate without a module. The tolerance is in rad.
    """

    target: Array
    module: str | None = None
    tolerance: float = TOLERANCE

    kind = rows.DIRECTION

    @property
    def names(self) -> tuple[str, ...]:
        """One for each row."""
        return tuple(f"{self.module or 'tool'} direction {i}" for i in (1, 2))

    def fill(self, targets: Array) -> None:
        """The direction, and two unit vectors across it."""
        targets[:, 0] = self.target
        rows.fill_across(targets)


@dataclass(frozen=True)
class Orientation(Rows):
    """A face has a rotation to G, shape (..., 3, 3): three rows, twice its Gibbs vector from the target.

    The face is the top face of a module, or the tip plate without a module. The tolerance is in rad.
    """

    target: Array
    module: str | None = None
    tolerance: float = TOLERANCE

    kind = rows.TURN
    _target_axes = 2

    @property
    def names(self) -> tuple[str, ...]:
        """One for each row."""
        return tuple(f"{self.module or 'tool'} turn about {axis}" for axis in _AXES)

    def fill(self, targets: Array) -> None:
        """The rotation."""
        targets[:] = self.target


@dataclass(frozen=True)
class GoalSpace:
    """Groups of rows for a batch of goals, at least one; all have the same number of targets, or one for all."""

    groups: tuple[Position | Direction | Orientation, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the rows."""
        return tuple(name for part in self.groups for name in part.names)

    @property
    def tolerance(self) -> Array:
        """Of each row, shape (m,), m or rad."""
        return np.array([part.tolerance for part in self.groups for _ in range(part.width)])

    @property
    def width(self) -> int:
        """Number of rows m."""
        return sum(part.width for part in self.groups)

    @property
    def count(self) -> int:
        """Number of goals."""
        return max(part.count for part in self.groups)

    def choose(self, which: Index) -> GoalSpace:
        """Some of the goals."""
        return GoalSpace(tuple(part.choose(which) for part in self.groups))


@dataclass(frozen=True)
class RowReport:
    """One row of one goal: coordinates desired and reached, m, absent for directions; residual, m or rad."""

    name: str
    desired: float | None
    reached: float | None
    residual: float
    tolerance: float


def tool_goal(position: ArrayLike, direction: ArrayLike) -> GoalSpace:
    """Five rows (8.1): tool position, m, and direction of any length but zero, in G, shapes (3,) or (B, 3).

    Raises:
        GoalError: A value is not finite, or a direction is zero.
    """
    at, along = np.asarray(position, float), np.asarray(direction, float)
    size = np.sqrt((along * along).sum(axis=-1, keepdims=True))
    near = max(np.abs(at).max(initial=0.0), size.max(initial=0.0)) < _FARTHEST  # finite, and their squares too
    if not (near and size.min(initial=1.0) > 1e-12):
        goal = f"goal at {np.array2string(at, threshold=6)} along {np.array2string(along, threshold=6)}"
        detail = f"{goal}: finite numbers and a direction that is not zero"
        raise GoalError(("tool x", "tool direction 1"), 0.0, detail)
    return GoalSpace((Position(at), Direction(along / size)))


def evaluate(chain: Chain, goal: GoalSpace, state: State, which: Index) -> tuple[Array, Array]:
    """Errors of the goal rows, shape (b, m), m and rad, and their Jacobian, shape (b, m, n).

    `which` is the goal of each configuration, shape (b,). Errors are reached less desired, those of directions and
    turns 2 tan(theta/2).
    """
    return measure(tabulate(chain, goal), state, which)


def measure(table: rows.Table, state: State, which: Index, slopes: bool = True) -> tuple[Array, Array]:
    """As `evaluate`, of rows in a table; the Jacobian has no columns where it is not asked for."""
    count, width = len(which), int(table[0][-1, 3] + table[0][-1, 4])
    error, J = np.empty((count, width)), np.empty((count, width, state.q.shape[1] if slopes else 0))
    rows.measure_rows(which, error, J, table, state.motion)
    return error, J


def tabulate(chain: Chain, goal: GoalSpace) -> rows.Table:
    """The rows of all goals as compiled functions take them."""
    targets = np.zeros((len(goal.groups), goal.count, 3, 3))
    for part, own in zip(goal.groups, targets, strict=True):
        part.fill(own)
    kinds = tuple((type(part), part.module, getattr(part, "axes", "")) for part in goal.groups)
    return *_seat(chain, kinds), targets


@lru_cache(maxsize=16)  # of the goals of a few arms: a plan asks for the same kinds again and again
def _seat(chain: Chain, kinds: tuple[tuple[type[Any], str | None, str], ...]) -> tuple[Index, Array, Index]:
    """Of a table all but the targets."""
    layout, row, none = chain.layout, 0, np.zeros(3)
    parts, axes = np.empty((len(kinds), 5), np.intp), np.zeros((len(kinds), 3), np.intp)
    spots = np.empty((len(kinds), 3, 5))
    for p, (kind, module, names) in enumerate(kinds):
        part = kind(none, names, module) if kind is Position else kind(none, module)
        face, inputs = part.place(chain)
        parts[p] = part.kind, layout.face_from[face], inputs, row, part.width
        spots[p, :, :4] = layout.face_offset[face, :3]
        spots[p, :, 4] = spots[p, :, 3] + part.offset(chain) * spots[p, :, 2]
        axes[p, : len(part.columns)] = part.columns
        row += part.width
    return parts, spots, axes


def report_rows(chain: Chain, goal: GoalSpace, q: Array) -> tuple[RowReport, ...]:
    """Desired, reached and residual of every row of one goal, for inputs of shape (n,)."""
    one = np.zeros(1, int)
    error = evaluate(chain, goal, chain.state(q[None]), one)[0][0]
    wanted: list[float | None] = []
    for part in goal.groups:
        places = isinstance(part, Position)
        wanted += part.targets(one)[0, list(part.columns)].tolist() if places else [None] * len(part.names)
    lines = zip(goal.names, wanted, error, goal.tolerance, strict=True)
    return tuple(
        RowReport(name, value, None if value is None else value + float(gap), float(gap), float(tolerance))
        for name, value, gap, tolerance in lines
    )
