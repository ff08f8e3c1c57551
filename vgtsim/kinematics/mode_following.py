"""Forward solutions that stay on the assembly mode of their start, with proof.

A plain Newton iteration may land on any of a cell's sixteen assemblies. Here the lengths run from those of the start
to the goal, t from 0 to 1. Every step is cut until the theorem of Newton and Kantorovich holds from the present angles
for every t of the step: beta K eta <= 1/2, with beta = |J^-1|, K a bound of the change of J per radian, and eta =
|J^-1 F|. Then a ball about the angles holds exactly one assembly at every t, with a regular Jacobian. So the assembly
moves continuously, and Newton started at the angles ends on it. Where no step passes, the path meets a singularity.

The bounds of the closure's change within a step come from its middle and its end; they are exact for closures that are
quadratic in t, and of third order in the step otherwise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.kinematics.closure import closure_slopes, closure_values, newton_step, solve_cyclic
from vgtsim.kinematics.ties import first_greatest

Array = NDArray[np.float64]
Path = Callable[[Array, NDArray[np.intp]], Array]

_KANTOROVICH = 0.5  # beta K eta; up to this value Newton's limit is the only assembly in its ball
_TARGET = 0.4  # what the next step is cut to: a little below, since the estimate is not exact
_NEWTON_STEPS = 4  # of a step: enough to stay in the next certified ball; the end is polished apart
_LEAST_STEP = 1e-7  # of the path: shorter certified steps mean a singularity this near
_MOST_STEPS = 4000  # certified ones: a path that needs more creeps along a singularity
_ROUNDING = 1e-10  # rad: a ball no smaller than the rounding of the angles
_SAME_VALUE = 1e-6  # of the greatest: singular values this near are one, whose directions are any mix
_POLISH = 2  # Newton steps after the last, which leave rounding only


@dataclass(frozen=True)
class FollowedMode:
    """Angles at which a batch of followed solutions ended, shape (N, 3), rad, and the part of the path covered, (N,)."""

    phi: Array
    reached: Array


def follow(path: Path, start: ArrayLike) -> FollowedMode:
    """Carry assemblies, angles of shape (N, 3), rad, along closures that change from t = 0 to t = 1.

    The path gives closures C, shape (5, 3, n), at t, shape (n,), of the members of the batch with indices, shape (n,).
    """
    # impossible lengths on the way give closures that are not numbers, which certify nothing: it ends there
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        return _follow(path, np.array(np.asarray(start, float).T))


def _follow(path: Path, phi: Array) -> FollowedMode:
    count = phi.shape[1]
    reached = np.zeros(count)
    stride = np.ones(count)
    active = np.arange(count)
    C = path(reached, active)
    for _ in range(_MOST_STEPS):
        if not active.size:
            break
        t = reached[active]
        dt = np.minimum(stride[active], 1.0 - t)
        goal = path(t + dt, active)
        reach, quality = _certify(C, path(t + dt / 2, active) - C, goal - C, phi[:, active])
        new, moved = _solve(goal, phi[:, active])
        good = (quality <= _KANTOROVICH) & (moved <= reach)
        done = active[good]
        phi[:, done] = new[:, good]
        reached[done] = np.where(dt[good] == 1.0 - t[good], 1.0, t[good] + dt[good])
        stride[active] = dt * np.clip((_TARGET / np.maximum(quality, 1e-12)) ** 0.6, 0.1, 4.0)
        stride[active[~good & (quality <= _KANTOROVICH)]] *= 0.5
        C[:, :, good] = goal[:, :, good]
        keep = (reached[active] < 1.0) & (stride[active] > _LEAST_STEP)
        active, C = active[keep], C[:, :, keep]
    return _polish(path, phi, reached)


def _solve(C: Array, phi: Array) -> tuple[Array, Array]:
    """Newton from the present angles; the angles, and how far they moved, shape (n,)."""
    new = phi
    for _ in range(_NEWTON_STEPS):
        new = new + newton_step(C, new)[0]
    return new, np.sqrt(np.sum((new - phi) ** 2, axis=0))


def _polish(path: Path, phi: Array, reached: Array) -> FollowedMode:
    whole = np.flatnonzero(reached == 1.0)
    C = path(np.ones(whole.size), whole)
    new = phi[:, whole]
    for _ in range(_POLISH):
        new = new + newton_step(C, new)[0]
    phi[:, whole] = new
    return FollowedMode(phi.T.copy(), reached)


def _certify(C: Array, middle: Array, end: Array, phi: Array) -> tuple[Array, Array]:
    """Radius of the ball that holds the assembly, rad, and beta K eta, over a step, shapes (n,); infinite where J is singular.

    C is the closure at the beginning, shape (5, 3, n); `middle` and `end` are its changes to there.
    """
    cosine, sine = np.cos(phi), np.sin(phi)
    p, q = closure_slopes(C, cosine, sine)
    determinant = p[0] * p[1] * p[2] + q[0] * q[1] * q[2]
    p1, p2 = p[[1, 2, 0]], p[[2, 0, 1]]
    beta = np.sqrt(np.sum((p1 * p2) ** 2 + (q * p2) ** 2 + (q * q[[1, 2, 0]]) ** 2, axis=0)) / np.abs(determinant)
    linear, quadratic = 4 * middle - end, 2 * end - 4 * middle
    eta = sum(
        _size(solve_cyclic(p, q, closure_values(item, cosine, sine), determinant)) for item in (C, linear, quadratic)
    )
    spread = np.abs(linear) + np.abs(quadratic)
    first, second = spread[1] + spread[3] + spread[4], spread[2] + spread[3] + spread[4]
    # the Jacobian at other t of the step: |J_t - J| bounds how much its inverse and eta may grow
    growth = 1.0 - beta * np.hypot(_size(first), _size(second))
    radius = 2 * eta / growth + _ROUNDING
    quality = beta * _curvature(C, spread, cosine, sine, radius) * (eta / growth**2)
    return radius, np.where(np.isfinite(quality) & (growth > 0), quality, np.inf)


def certify_box(C: Array, half: ArrayLike, phi: Array) -> tuple[Array, Array]:
    """As for a step, over all squared edges within boxes: the Jacobian does not depend on them.

    C are closures at the boxes' centres, shape (5, 3, n), m², `half` the half edges of the boxes, shape (3,), m², and
    phi angles that close there, shape (n, 3), rad.

    Returns:
        Radius of the ball (in the greatest angle) that holds one assembly for each point of the box, rad, and eta
        times the bound of J^-1 F'', each shape (n,): at most 1/2 where that is proved, infinite where J is singular.
    """
    angle = phi.T
    cosine, sine = np.cos(angle), np.sin(angle)
    p, q = closure_slopes(C, cosine, sine)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = np.abs(_inverse(p, q))
        eta = np.einsum("ijn,j->in", inverse, np.asarray(half, float)).max(axis=0)
        radius = 2 * eta + _ROUNDING
        own, other, mixed = _second_derivatives(C, np.zeros(C.shape), cosine, sine, radius)
        quality = np.einsum("ijn,jn->in", inverse, own + other + 2 * mixed).max(axis=0) * eta
    return radius, np.where(np.isfinite(quality), quality, np.inf)


def _inverse(p: Array, q: Array) -> Array:
    """Inverse of the cyclic matrix with p on the diagonal and q beside it, shape (3, 3, n)."""
    unit = np.broadcast_to(np.eye(3)[..., None], (3, *p.shape))
    determinant = p[0] * p[1] * p[2] + q[0] * q[1] * q[2]
    return np.stack([solve_cyclic(p, q, column, determinant) for column in unit], axis=1)


def _size(rows: Array) -> Array:
    """Norm over the three rows, shape (n,)."""
    return np.sqrt(np.sum(rows**2, axis=0))


def _curvature(C: Array, spread: Array, cosine: Array, sine: Array, radius: Array) -> Array:
    """Bound of the change of J per radian in a ball, for a closure within its spread, shape (n,)."""
    own, other, mixed = _second_derivatives(C, spread, cosine, sine, radius)
    return np.sqrt(np.sum(own**2 + other**2 + 2 * mixed**2, axis=0))


def _second_derivatives(
    C: Array, spread: Array, cosine: Array, sine: Array, radius: Array
) -> tuple[Array, Array, Array]:
    """Bounds of each row's second derivatives by its own angle, by the next, and by both, shapes (3, n)."""
    _, b, g, e, f = C
    c2, s2 = cosine[[1, 2, 0]], sine[[1, 2, 0]]
    bound = np.abs(C) + spread
    further = radius * (bound[1] + bound[2] + 4 * bound[4])  # third derivatives
    own = np.abs(b * cosine + e * cosine * c2 + f * sine * s2) + spread[1] + spread[3] + spread[4]
    other = np.abs(g * c2 + e * cosine * c2 + f * sine * s2) + spread[2] + spread[3] + spread[4]
    mixed = np.abs(e * sine * s2 + f * cosine * c2) + spread[3] + spread[4]
    return own + further, other + further, mixed + further


def worst_row(left: Array, value: Array) -> NDArray[np.intp]:
    """Row with most of what is lost at the smallest singular value, shape (...), the first of equals.

    Left singular vectors have shape (..., n, n), falling singular values (..., n). All directions of one value count,
    because which of them come out is chance.
    """
    same = value <= value[..., -1:] + _SAME_VALUE * value[..., :1]
    return first_greatest(np.sum(left**2 * same[..., None, :], axis=-1), axis=-1)


def worst_direction(J: ArrayLike, scale: ArrayLike = 1.0) -> tuple[float, int]:
    """Smallest singular value of J / scale, and the index of the row with most of its left singular vector.

    J are derivatives of lengths, one row each, shape (n, n); the scale has the units of the columns, shape (n,).
    """
    left, value, _ = np.linalg.svd(np.asarray(J, float) / np.asarray(scale, float))
    return float(value[-1]), int(worst_row(left, value))
