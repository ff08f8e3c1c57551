"""Goal spaces: which rows a configuration must meet, at the tool or at any face of the arm (section 5.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import GoalError
from vgtsim.kinematics.chain import Chain
from vgtsim.positioning.kernel import Kernel, State, cross

Array = NDArray[np.float64]
Index = NDArray[np.intp]

TOLERANCE = 1e-9
_AXES = "xyz"


@dataclass(frozen=True)
class Position:
    """A point of the arm is at a place.

    Attributes:
        target: In frame G, shape (..., 3), m; leading dimension over goals.
        axes: Which of x, y, z count.
        module: Whose top face's centroid is meant; absent for the tool point.
        tolerance: m.
    """

    target: Array
    axes: str = "xyz"
    module: str | None = None
    tolerance: float = TOLERANCE

    @property
    def names(self) -> tuple[str, ...]:
        """One for each row."""
        return tuple(f"{self.module or 'tool'} {axis}" for axis in self.axes)


@dataclass(frozen=True)
class Direction:
    """The normal of a face points somewhere: two rows.

    Attributes:
        target: In frame G, shape (..., 3), unit.
        module: Whose top face is meant; absent for the tip plate.
        tolerance: rad.
    """

    target: Array
    module: str | None = None
    tolerance: float = TOLERANCE

    @property
    def names(self) -> tuple[str, ...]:
        """One for each row."""
        return tuple(f"{self.module or 'tool'} direction {i}" for i in (1, 2))


@dataclass(frozen=True)
class Orientation:
    """A face has a full orientation: three rows.

    Attributes:
        target: Rotation from the face's frame to G, shape (..., 3, 3).
        module: Whose top face is meant; absent for the tip plate.
        tolerance: rad.
    """

    target: Array
    module: str | None = None
    tolerance: float = TOLERANCE

    @property
    def names(self) -> tuple[str, ...]:
        """One for each row."""
        return tuple(f"{self.module or 'tool'} turn about {axis}" for axis in _AXES)


Rows = Position | Direction | Orientation


@dataclass(frozen=True)
class GoalSpace:
    """All the rows of a batch of goals.

    Attributes:
        parts: What must hold, at least one; all targets have the same number of goals, or one for all.
    """

    parts: tuple[Rows, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the rows."""
        return tuple(name for part in self.parts for name in part.names)

    @property
    def tolerance(self) -> Array:
        """Of each row, shape (m,), m or rad."""
        return np.concatenate([np.full(len(part.names), part.tolerance) for part in self.parts])

    @property
    def count(self) -> int:
        """Number of goals."""
        return max(_batch(part) for part in self.parts)


@dataclass(frozen=True)
class RowReport:
    """One row of one goal.

    Attributes:
        name: Of the row.
        desired: Coordinate wanted, m; absent for rows of directions.
        reached: Coordinate reached, m; absent for rows of directions.
        residual: Reached less desired, m or rad.
        tolerance: m or rad.
    """

    name: str
    desired: float | None
    reached: float | None
    residual: float
    tolerance: float


def tool_goal(position: ArrayLike, direction: ArrayLike, tolerance: float = TOLERANCE) -> GoalSpace:
    """Rows for tool position and direction (8.1): five.

    Args:
        position: In frame G, shape (3,) or (B, 3), m.
        direction: In frame G, the same shape, any length but zero.
        tolerance: m and rad.

    Returns:
        The goals.

    Raises:
        GoalError: A value is not finite, or a direction is zero.
    """
    at, along = np.asarray(position, float), np.asarray(direction, float)
    size = np.linalg.norm(along, axis=-1, keepdims=True)
    if not (np.all(np.isfinite(at)) and np.all(np.isfinite(along)) and np.all(size > 1e-12)):
        detail = f"goal at {np.array2string(at, threshold=6)} along {np.array2string(along, threshold=6)}"
        raise GoalError(
            ("tool x", "tool direction 1"), 0.0, f"{detail}: finite numbers and a direction that is not zero"
        )
    return GoalSpace((Position(at, tolerance=tolerance), Direction(along / size, tolerance=tolerance)))


def evaluate(chain: Chain, goal: GoalSpace, state: State, which: Index | None = None) -> tuple[Array, Array]:
    """Errors of the goal rows and their derivatives.

    Args:
        chain: The arm.
        goal: Rows.
        state: Kinematics of b configurations.
        which: Goal of each configuration, shape (b,); absent for the first b goals.

    Returns:
        Reached less desired, shape (b, m), m and rad, directions and turns as 2 tan(theta/2); and the Jacobian, shape
        (b, m, n).
    """
    kernel = Kernel(chain)
    take = np.arange(len(state.q)) if which is None else which
    errors, slopes = [], []
    for part in goal.parts:
        target = _for_goals(part, take)
        face, inputs = _place(chain, part)
        frame = kernel.face(state, face)
        if isinstance(part, Position):
            error, J = _position_rows(chain, part, target, frame, (state.angular, state.linear))
        elif isinstance(part, Direction):
            error, J = _direction_rows(target, frame[0][..., 2], state.angular)
        else:
            error, J = _orientation_rows(target, frame[0], state.angular)
        J[:, :, inputs:] = 0.0
        errors.append(error)
        slopes.append(J)
    return np.concatenate(errors, axis=1), np.concatenate(slopes, axis=1)


def report_rows(chain: Chain, goal: GoalSpace, q: Array, which: int = 0) -> tuple[RowReport, ...]:
    """Desired, reached and residual of every row.

    Args:
        chain: The arm.
        goal: Rows.
        q: Inputs, shape (n,).
        which: The goal.

    Returns:
        One report for each row.
    """
    error = evaluate(chain, goal, Kernel(chain).state(q[None]), np.array([which]))[0][0]
    wanted: list[float | None] = []
    for part in goal.parts:
        if isinstance(part, Position):
            target = _for_goals(part, np.array([which]))[0]
            wanted += [float(target[_AXES.index(axis)]) for axis in part.axes]
        else:
            wanted += [None] * len(part.names)
    rows = zip(goal.names, wanted, error, goal.tolerance, strict=True)
    return tuple(
        RowReport(name, value, None if value is None else value + float(gap), float(gap), float(tolerance))
        for name, value, gap, tolerance in rows
    )


@dataclass(frozen=True)
class Pull:
    """What multipliers of one group of rows do to a face: linear forms on its motion.

    Attributes:
        face: Of the chain.
        inputs: Number of inputs that move it, the first ones.
        offset: Of the point from the face along its normal, m.
        point: On the velocity of the point, shape (b, 3).
        direction: On the rate of the normal, shape (b, 3).
        turn: On the angular velocity, shape (b, 3).
    """

    face: int
    inputs: int
    offset: float
    point: Array
    direction: Array
    turn: Array


def pulls(chain: Chain, goal: GoalSpace, state: State, which: Index, multipliers: Array) -> tuple[Pull, ...]:
    """Multipliers of the rows as linear forms on the motion of faces, for rows that are met.

    Args:
        chain: The arm.
        goal: Rows.
        state: Kinematics of b configurations.
        which: Goal of each, shape (b,).
        multipliers: Shape (b, m).

    Returns:
        One for each part of the goal space.
    """
    found, row, none = [], 0, np.zeros((len(state.q), 3))
    for part in goal.parts:
        mine = multipliers[:, row : row + len(part.names)]
        row += len(part.names)
        face, inputs = _place(chain, part)
        target = _for_goals(part, which)
        if isinstance(part, Position):
            offset = chain.manipulator.tip_plate.tool_offset if part.module is None else 0.0
            force = np.zeros(none.shape)
            force[:, [_AXES.index(axis) for axis in part.axes]] = mine
            found.append(Pull(face, inputs, offset, force, none, none))
        elif isinstance(part, Direction):
            found.append(Pull(face, inputs, 0.0, none, (mine[:, None] @ _across(target))[:, 0], none))
        else:
            found.append(Pull(face, inputs, 0.0, none, none, mine))
    return tuple(found)


def _across(target: Array) -> Array:
    """Two unit vectors across each direction, shape (b, 2, 3)."""
    helper = np.eye(3)[np.argmin(np.round(np.abs(target), 9), axis=-1)]  # the first of equals
    first = cross(target, helper)
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    return np.stack([first, cross(target, first)], axis=1)


def _batch(part: Rows) -> int:
    return int(np.prod(part.target.shape[: -2 if isinstance(part, Orientation) else -1], dtype=int))


def _for_goals(part: Rows, take: Index) -> Array:
    """Targets of the goals asked for, shape (b, 3) or (b, 3, 3)."""
    shape = (-1, 3, 3) if isinstance(part, Orientation) else (-1, 3)
    targets = part.target.reshape(shape)
    return targets[take if len(targets) > 1 else np.zeros_like(take)]


def _place(chain: Chain, part: Rows) -> tuple[int, int]:
    """Face a row is about, and the number of inputs of the active modules before it."""
    modules, layout = chain.manipulator.modules, chain.layout
    if part.module is None:
        return len(modules), layout.inputs
    names = [module.name for module in modules]
    if part.module not in names:
        raise GoalError(part.names, 0.0, f"no module {part.module!r}; modules: {', '.join(names)}")
    face = names.index(part.module) + 1
    return face, int(np.searchsorted(layout.owner, layout.face_from[face]))


def _position_rows(
    chain: Chain, part: Position, target: Array, frame: tuple[Array, Array], screw: tuple[Array, Array]
) -> tuple[Array, Array]:
    R, P = frame
    offset = chain.manipulator.tip_plate.tool_offset if part.module is None else 0.0
    point = P + offset * R[..., 2]
    rows = [_AXES.index(axis) for axis in part.axes]
    velocity = screw[1] + cross(screw[0], point[:, None])
    return (point - target)[:, rows], np.swapaxes(velocity[..., rows], 1, 2)


def _direction_rows(target: Array, direction: Array, angular: Array) -> tuple[Array, Array]:
    axes = _across(target)
    along = np.maximum(1 + np.sum(direction * target, axis=-1), 1e-6)[:, None]
    turn = 2 * (axes @ direction[..., None])[..., 0] / along
    rates = (2 * axes - turn[..., None] * target[:, None]) / along[..., None]
    # rate of the direction is omega x direction, so its part along a row is omega . (direction x row)
    return turn, cross(direction[:, None], rates) @ np.swapaxes(angular, 1, 2)


def _orientation_rows(target: Array, R: Array, angular: Array) -> tuple[Array, Array]:
    off = R @ np.swapaxes(target, -1, -2)
    scale = np.maximum(1 + np.trace(off, axis1=-2, axis2=-1), 1e-6)[:, None]
    skew = off - np.swapaxes(off, -1, -2)
    gibbs = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=-1) / scale
    rates = angular + np.sum(angular * gibbs[:, None], axis=-1, keepdims=True) * gibbs[:, None]
    rates = rates - cross(gibbs[:, None], angular)
    return 2 * gibbs, np.swapaxes(rates, 1, 2)
