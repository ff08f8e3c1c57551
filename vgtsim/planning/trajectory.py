"""Way-points between two configurations, moved until they are short, smooth and clear.

A damped Gauss-Newton iteration makes a sum of squares small: first and second differences of the actuator lengths along
the way, and hinges for strokes and clearances, which grow before a limit is met. The matrix is block-banded, since a
way-point feels only two neighbours on either side.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.linalg import solveh_banded

from vgtsim.arrays import Array, Index
from vgtsim.errors import AssemblyError
from vgtsim.kinematics import Subspace
from vgtsim.positioning import StrokeBox, Surroundings

_LENGTH = 0.1  # a difference of this size counts one, m
_BEND = 0.05  # weight of second differences against first ones, in units of the way's whole length
_HINGE = 20.0  # weight of a hinge at its limit: well above what a detour around it costs
_STROKE_SOFT = 0.02  # width of the stroke hinge inside the box, m
_LEAST_DAMPING = 1e-9  # keeps the equations definite where the way stands in a singular pose: rounding leaves 1e-13
_SETTLED = 1e-3  # relative fall of the sum below which a further step is not worth its price


@dataclass(frozen=True)
class Corridor:
    """The limits of the way-points: strokes, and a least clearance, m, whose hinge begins `softness`, m, beyond it.

    Way-points stay in a subspace of the inputs; absent for the one that static longerons leave.
    """

    box: StrokeBox
    surroundings: Surroundings
    clearance: float
    softness: float = 0.08
    subspace: Subspace | None = None

    @cached_property
    def space(self) -> Subspace:
        """The subspace."""
        return self.subspace or Subspace(self.box.chain)


def smooth(corridor: Corridor, way: Array, most: int = 40) -> Array:
    """Make way-points, shape (W, n), of the corridor's subspace short, smooth and clear, in `most` steps; the ends stay."""
    stiffness = _stiffness(len(way))
    damping, value = 1e-4, _value(corridor, way, stiffness)
    for _ in range(most):
        slope, bands, basis = _normal_equations(corridor, way, stiffness)
        for _ in range(8):
            trial = _advance(corridor.space, way, _step(slope, bands, damping, basis), basis)
            after = np.inf if trial is None else _value(corridor, trial, stiffness)
            if trial is not None and after < value:
                break
            damping *= 8
        else:
            return way
        done = value - after < _SETTLED * value
        way, value, damping = trial, after, max(damping / 4, _LEAST_DAMPING)
        if done:
            break
    return way


def _advance(space: Subspace, way: Array, step: Array, basis: Array | None) -> Array | None:
    """Way-points after a step, in the subspace; None where there is no point of it near."""
    if basis is None:
        return way + step
    try:
        return np.concatenate([way[:1], space.project((way + step)[1:-1]), way[-1:]])
    except AssemblyError:
        return None


def assemblable(corridor: Corridor, way: Array) -> Array | None:
    """Pull inner way-points, shape (W, n), towards the middle of the strokes until every one assembles in the subspace.

    None where none of them can be brought into it.
    """
    found = None
    for part in np.linspace(0.0, 1.0, 11):
        trial = np.array(way)
        trial[1:-1] += part * (corridor.box.middle - way[1:-1])
        trial = _advance(corridor.space, trial, np.zeros(trial.shape), None if corridor.space.whole else trial)
        if trial is not None and np.all(corridor.box.chain.state(trial).assembles):
            return trial
        found = trial if found is None else found
    return found


def _stiffness(count: int) -> Array:
    """Matrix of the differences' sum of squares, shape (W, W), pentadiagonal."""
    first = np.diff(np.eye(count), axis=0) * np.sqrt(count - 1)
    second = np.diff(np.eye(count), n=2, axis=0) * np.sqrt(_BEND) * (count - 1) ** 1.5
    return (first.T @ first + second.T @ second) / _LENGTH**2 / 100


def _hinges(corridor: Corridor, length: Array) -> tuple[Array, Array]:
    """Stroke hinges at retraction and extension, each shape (W, J): from 0 to 1 at the limit."""
    box = corridor.box
    low = np.maximum(0.0, 1 - (length - box.least) / _STROKE_SOFT)
    high = np.maximum(0.0, 1 - (box.greatest - length) / _STROKE_SOFT)
    return low, high


def _value(corridor: Corridor, way: Array, stiffness: Array) -> float:
    """Half the sum of squares; infinite when a way-point does not assemble."""
    state = corridor.box.chain.state(way)
    if not np.all(state.assembles):
        return np.inf
    low, high = _hinges(corridor, state.lengths)
    rows = corridor.surroundings.rows(state, corridor.clearance + corridor.softness, slopes=False)
    inner = (rows.config > 0) & (rows.config < len(way) - 1)
    excess = 1 + (corridor.clearance - rows.gap[inner]) / corridor.softness
    hinges = np.sum(low[1:-1] ** 2) + np.sum(high[1:-1] ** 2) + np.sum(excess**2)
    return 0.5 * float(np.sum(state.lengths * (stiffness @ state.lengths))) + 0.5 * _HINGE * float(hinges)


def _normal_equations(corridor: Corridor, way: Array, stiffness: Array) -> tuple[Array, Array, Array | None]:
    """Slope, shape (W - 2, f), and blocks [i, i + o] of the matrix, shape (3, W - 2, f, f), by directions of the subspace.

    The directions are columns, shape (W - 2, n, f); absent where they are the inputs.
    """
    state = corridor.box.chain.state(way)
    wide = state.leg_slopes[:, : state.lengths.shape[1]]
    count, size = state.q.shape
    low, high = _hinges(corridor, state.lengths)
    pull = stiffness @ state.lengths + _HINGE / _STROKE_SOFT * (high - low)
    slope = np.einsum("wij,wi->wj", wide, pull)
    curve = _HINGE / _STROKE_SOFT**2 * ((low > 0) | (high > 0))
    bands = np.zeros((3, count, size, size))
    for offset in range(3):
        weight = np.diagonal(stiffness, offset)[:, None, None]
        left = wide[: count - offset] * weight
        if offset == 0:
            left = left + curve[..., None] * wide
        bands[offset, : count - offset] = np.swapaxes(left, 1, 2) @ wide[offset:]
    rows = corridor.surroundings.rows(state, corridor.clearance + corridor.softness)
    excess = 1 + (corridor.clearance - rows.gap) / corridor.softness
    np.add.at(slope, rows.config, -_HINGE / corridor.softness * excess[:, None] * rows.gradient)
    outer = rows.gradient[:, :, None] * rows.gradient[:, None, :]
    np.add.at(bands[0], rows.config, _HINGE / corridor.softness**2 * outer)
    slope, bands = slope[1:-1], bands[:, 1:-1]
    if corridor.space.whole:
        return slope, bands, None
    basis = corridor.space.basis(state)[1:-1]
    along = np.swapaxes(basis, 1, 2)
    blocks = np.zeros((3, count - 2, basis.shape[2], basis.shape[2]))
    for offset in range(3):
        inner = slice(0, count - 2 - offset)
        blocks[offset, inner] = along[inner] @ bands[offset, inner] @ basis[offset:]
    return (along @ slope[..., None])[..., 0], blocks, basis


@lru_cache(maxsize=8)
def _band_places(count: int, size: int) -> tuple[Index, Index]:
    """Entries of the flattened blocks, shape (3, W - 2, n, n), and where they stand in flattened upper band storage."""
    offset, i, row, column = np.indices((3, count, size, size))
    above = offset * size + column - row  # diagonals above the main one
    keep = (above >= 0) & (i + offset < count)
    place = (3 * size - 1 - above) * (count * size) + (i + offset) * size + column
    return np.flatnonzero(keep), place[keep]


def _step(slope: Array, bands: Array, damping: float, basis: Array | None) -> Array:
    """Damped Gauss-Newton step of all way-points, the ends still, shape (W, n); arguments as of `_normal_equations`."""
    count, size = slope.shape
    entries, places = _band_places(count, size)
    upper = np.zeros((3 * size, count * size))
    upper.ravel()[places] = bands.ravel()[entries]
    upper[-1] *= 1 + damping
    inner = -solveh_banded(upper, slope.ravel()).reshape(count, size)
    if basis is not None:
        inner = (basis @ inner[..., None])[..., 0]
    return np.pad(inner, ((1, 1), (0, 0)))
