"""Displacements from stiffness matrices in band storage, by Cholesky, and whether a matrix may be solved with at all.

A singular matrix is told by its smallest eigenvalue with every node scaled to one: a pure number, the same on every
processor. One for every pose would cost more than the solve. So every solve has one more right side, of drawn signs, whose
response is never softer than that eigenvalue allows; only where it is suspiciously soft is the eigenvalue found.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, get_lapack_funcs

from vgtsim.errors import TrussError
from vgtsim.kinematics import Truss, warn_poor
from vgtsim.statics.framework import Framework, find_mechanism
from vgtsim.statics.stiffness_matrix import Pattern, Stiffness, unfold

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_PBSV, _POTRF = get_lapack_funcs(("pbsv", "potrf"), dtype=np.float64)
# smallest eigenvalues, every node scaled to one. Shipped arms: elastic 1e-5, on servos a hundred thousand times softer
# than their members 1e-10; rounding leaves 2e-15 of a mechanism
SINGULAR = 1e-13
POOR = 1e-11  # warned of: five digits are left
_SUSPECT = 1e-10  # response to the drawn load below which the eigenvalue is found
_SHARE = 0.3  # part of the largest elongation above which a bar is named


@lru_cache(maxsize=16)
def _drawn(size: int) -> Array:
    """A load that no mode is square to but by accident, shape (n,); the square of its length is n."""
    load = np.random.default_rng(size).standard_normal(size)
    return load * np.sqrt(size) / np.linalg.norm(load)


def solve_poses(
    truss: Truss | Framework, nodes: Array, matrices: Stiffness, load: Array, numbers: Indices | None = None
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
    truss: Truss | Framework, nodes: Array, matrices: Stiffness, pose: int = 0, numbers: Indices | None = None
) -> None:
    """Refuse a pose of the batch in which the truss can move without a bar resisting; arguments as for `solve_poses`.

    Raises:
        TrussError: It can; its members are named.
    """
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
    found = find_mechanism(truss, nodes[pose])
    if found is not None:
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
