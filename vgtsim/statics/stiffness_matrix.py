"""Stiffness matrices in band storage, for any framework: assembled through index tables made once, and solved by Cholesky.

A node's displacement depends on w of the unknowns: its own three, or the six of a rigid body that it is fixed to.

A singular matrix is told by its smallest eigenvalue with every node scaled to one: a pure number, the same on every
processor. One for every pose would cost more than the solve. So every solve has one more right side, of drawn signs, whose
response is never softer than that eigenvalue allows; only where it is suspiciously soft is the eigenvalue found.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.linalg import eigh, get_lapack_funcs

from vgtsim.arrays import Array, Index
from vgtsim.errors import TrussError
from vgtsim.kinematics import Truss, warn_poor
from vgtsim.statics.framework import Framework, find_fault

_PBSV, _POTRF = get_lapack_funcs(("pbsv", "potrf"), dtype=np.float64)
# smallest eigenvalues, every node scaled to one. Shipped arms: elastic 1e-5, on servos a hundred thousand times softer
# than their members 1e-10; rounding leaves 2e-15 of a mechanism
SINGULAR = 1e-13
POOR = 1e-11  # warned of: five digits are left
_SUSPECT = 1e-10  # response to the drawn load below which the eigenvalue is found
_SHARE = 0.3  # part of the largest elongation above which a bar is named


@dataclass(frozen=True)
class Pattern:
    """Where each bar's stiffness goes in the banded matrix; made once for a truss of `size` unknowns.

    Attributes:
        band: Number of diagonals above the main one.
        dof: Unknowns that the two ends of each bar depend on, shape (B, 2 w); -1 where there is none.
        pairs: Pairs of those that land in the upper triangle, rows bar, first and second, shape (3, P).
        place: Where in flattened band storage each pair goes, shape (P,).
        alike: First of the unknowns that share a node and a unit with each, shape (n,).
    """

    size: int
    band: int
    dof: Index
    pairs: Index
    place: Index
    alike: Index

    @cached_property
    def _groups(self) -> tuple[Index, Index]:
        """First unknown of each group, and the group of each unknown."""
        starts, group = np.unique(self.alike, return_inverse=True)
        return starts, group

    def scale(self, diagonal: Array) -> Array:
        """Sizes of the unknowns, shape (..., n), by a matrix's diagonal: of a node, the root of its greatest entry."""
        starts, group = self._groups
        greatest = np.maximum.reduceat(np.maximum(diagonal, 0.0), starts, axis=-1)
        return np.sqrt(greatest[..., group])


@lru_cache(maxsize=16)
def make_pattern(unknowns: tuple[tuple[int, ...], ...], ends: tuple[tuple[int, int], ...]) -> Pattern:
    """Lay the band out for w unknowns of each node, -1 where there is none, and node indices of each bar's ends."""
    of_node = np.array(unknowns, dtype=np.intp)
    dof = of_node[np.array(ends, dtype=np.intp)].reshape(len(ends), -1)
    size = int(of_node.max(initial=-1)) + 1
    first, second = dof[:, :, None], dof[:, None, :]
    pairs = np.array(np.nonzero((first >= 0) & (second >= 0) & (first <= second)), dtype=np.intp)
    i, j = dof[pairs[0], pairs[1]], dof[pairs[0], pairs[2]]
    band = int((j - i).max(initial=0))
    alike = np.arange(size)
    for triple in of_node.reshape(-1, 3):
        own = triple[triple >= 0]
        alike[own] = own.min(initial=size)
    return Pattern(size=size, band=band, dof=dof, pairs=pairs, place=(band + i - j) * size + j, alike=alike)


@dataclass(frozen=True)
class Stiffness:
    """Stiffness matrices of a truss in a batch of poses, and what they are made of.

    Attributes:
        grow: Elongation of each bar per unit of each of its unknowns, shape (T, B, 2 w).
        spring: Stiffnesses of the bars, shape (T, B), N/m.
        upper: The matrices in upper band storage, shape (T, band + 1, n).
    """

    pattern: Pattern
    grow: Array
    spring: Array
    upper: Array

    def bar(self, moved: Array) -> Array:
        """Bar forces, shape (T, B, R), N, by unknowns, shape (T, n, R)."""
        taken = np.where(self.pattern.dof[..., None] >= 0, moved[:, self.pattern.dof], 0.0)
        return self.spring[..., None] * np.einsum("tmk,tmkr->tmr", self.grow, taken)


def assemble(pattern: Pattern, grow: Array, spring: Array) -> Stiffness:
    """Add the bars up: elongations per unknown, shape (T, B, 2 w), and stiffnesses, shape (T, B), N/m."""
    bar, first, second = pattern.pairs
    value = (spring[..., None] * grow)[:, bar, first] * grow[:, bar, second]
    room = (pattern.band + 1) * pattern.size
    place = pattern.place + room * np.arange(len(grow))[:, None]
    matrix = np.asarray(np.bincount(place.ravel(), value.ravel(), room * len(grow)), float)
    return Stiffness(pattern, grow, spring, matrix.reshape(len(grow), pattern.band + 1, pattern.size))


def unfold(upper: Array) -> Array:
    """Upper band storage, shape (band + 1, n), as a full symmetric matrix, shape (n, n)."""
    band, size = upper.shape[0] - 1, upper.shape[1]
    full = np.zeros((size, size))
    for above in range(band + 1):
        i = np.arange(size - above)
        full[i, i + above] = full[i + above, i] = upper[band - above, above:]
    return full


def geometric_blocks(span: Array, bar: Array, difference: Array) -> Array:
    """What bar forces add to the stiffness, symmetric, shape (B, 2 w, 2 w): a pulled bar resists turning by force over length.

    Args:
        span: From the first to the second end of each bar, shape (B, 3), m.
        bar: Forces, tension positive, shape (B,), N.
        difference: Displacement of the second end less that of the first per unit unknown, shape (B, 3, 2 w).
    """
    length = np.linalg.norm(span, axis=-1)
    unit = span / length[:, None]
    across = np.eye(3) - unit[:, :, None] * unit[:, None, :]
    return np.einsum("mki,mkl,mlj->mij", difference, across * (bar / length)[:, None, None], difference)


def add_blocks(pattern: Pattern, blocks: Array) -> Array:
    """Add blocks of the bars, shape (B, 2 w, 2 w), into a matrix of the unknowns, shape (n, n)."""
    dof = np.where(pattern.dof < 0, pattern.size, pattern.dof)
    total = np.zeros((pattern.size + 1, pattern.size + 1))
    np.add.at(total, (dof[:, :, None], dof[:, None, :]), blocks)
    return total[:-1, :-1]


@lru_cache(maxsize=16)
def _drawn(size: int) -> Array:
    """A load that no mode is square to but by accident, shape (n,); the square of its length is n."""
    load = np.random.default_rng(size).standard_normal(size)
    return load * np.sqrt(size) / np.linalg.norm(load)


def solve_poses(
    truss: Truss | Framework, nodes: Array, matrices: Stiffness, load: Array, numbers: Index | None = None
) -> Array:
    """Unknowns of T poses by their loads, both of shape (T, n, R): m and rad by N and N·m.

    `nodes` of shape (T, N, 3), m, and `numbers` of the poses, shape (T,), serve to name a fault.

    Raises:
        TrussError: The truss is a mechanism, or bars have no stiffness; they are named.
    """
    count, size, sides = load.shape
    scale = matrices.pattern.scale(matrices.upper[:, -1])
    loads = np.empty((count, size, sides + 1))
    loads[..., :sides] = load
    loads[..., sides] = scale * _drawn(size)
    failed = np.zeros(count, bool)
    for pose in range(count):
        _, loads[pose], failed[pose] = _PBSV(matrices.upper[pose], loads[pose])
    with np.errstate(divide="ignore", invalid="ignore"):
        response = np.sqrt(size / np.einsum("ti,ti->t", scale * loads[..., sides], scale * loads[..., sides]))
    for pose in np.flatnonzero(failed | ~(response > _SUSPECT)):
        require_stiff(truss, nodes, matrices, int(pose), numbers)
    return loads[..., :sides]


def require_stiff(
    truss: Truss | Framework, nodes: Array, matrices: Stiffness, pose: int = 0, numbers: Index | None = None
) -> None:
    """Refuse a pose of the batch in which the truss moves without a bar resisting; arguments and error as for `solve_poses`."""
    matrix = unfold(matrices.upper[pose])
    if is_sound(matrix, matrices.pattern, POOR):
        return
    value, modes = softest(matrix, matrices.pattern, SINGULAR)
    where = "" if numbers is None else f"pose {numbers[pose]}: "
    if value >= POOR:
        return
    if value >= SINGULAR:
        warn_poor(f"{where}stiffness matrix near singular, smallest scaled eigenvalue", value, POOR)
        return
    figure = f"smallest scaled eigenvalue of the stiffness {value:.2g}, sound from {SINGULAR:.0e}"
    _, found, loose = find_fault(truss, nodes[pose])
    if found is not None and loose:
        raise TrussError(found.rank, found.members, f"{where}{found.detail}; {figure}")
    place = matrices.pattern.dof
    taken = np.where((place >= 0)[..., None], modes[place], 0.0)
    stretched = np.linalg.norm(np.einsum("bi,bik->bk", matrices.grow[pose], taken), axis=-1)
    names = truss.bars if isinstance(truss, Framework) else truss.member_names
    slack = np.flatnonzero(~(stretched <= _SHARE * np.nanmax(stretched)))
    weak = ", ".join(f"{names[i]} {matrices.spring[pose, i]:.3g} N/m" for i in slack[:3])
    detail = f"{where}a mechanism, or nearly: its softest motion stretches {weak}; {figure}"
    raise TrussError(matrices.pattern.size, tuple(names[i] for i in slack), detail)


def softest(matrix: Array, pattern: Pattern, bound: float) -> tuple[float, Array]:
    """Smallest eigenvalue of a symmetric matrix, shape (n, n), with every node scaled to one, and the modes below a bound.

    The eigenvalue is a pure number, NaN where an entry is. The modes, shape (n, k), in the units of the unknowns, are all
    below the bound, because their mix is chance, or else the softest one.
    """
    if not np.all(np.isfinite(matrix)):
        return float("nan"), np.full((len(matrix), 1), np.nan)
    scaled, scale = _scale(matrix, pattern)
    value, mode = eigh(scaled)
    return float(value[0]), scale[:, None] * mode[:, : max(1, np.count_nonzero(value < bound))]


def is_sound(matrix: Array, pattern: Pattern, bound: float) -> bool:
    """Whether the eigenvalue that `softest` gives is above a bound; a twentieth of its cost.

    The matrix less the bound has a Cholesky factor just then, but for rounding: 2e-15 of the arms here.
    """
    scaled, _ = _scale(matrix, pattern)
    scaled.flat[:: len(scaled) + 1] -= bound
    factor, failed = _POTRF(scaled, clean=False)
    return failed == 0 and bool(np.isfinite(np.diag(factor)).all())  # OpenBLAS goes on past an entry that is no number


def _scale(matrix: Array, pattern: Pattern) -> tuple[Array, Array]:
    """The matrix with every node scaled to one, shape (n, n), and the scales of its unknowns, shape (n,)."""
    size = pattern.scale(np.diag(matrix))
    scale = 1 / np.where(size > 0, size, 1.0)
    return matrix * scale * scale[:, None], scale
