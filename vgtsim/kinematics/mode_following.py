"""Forward solutions that stay on the assembly mode of their start, with proof.

A plain Newton iteration may land on any of a cell's sixteen assemblies. Here the lengths run from those of the start to
those wanted, and every step is cut until a contraction argument holds: with J the Jacobian at the present angles and
beta = |J^-1|, the map phi - J^-1 F_t(phi) contracts by a half on a ball about them for every t of the step. Then the
ball holds exactly one assembly at every t, it moves continuously and its Jacobian is regular all the way, so the assembly
that Newton finds in the ball is on the mode of the start. Where no step passes, the path meets a singularity.

The bounds of the closure's change within a step come from its middle and its end; they are exact for closures that are
quadratic in t and of third order in the step otherwise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.kinematics.octahedral_closure import closure_slopes, closure_values, newton_step, solve_cyclic

Array = NDArray[np.float64]
Path = Callable[[Array, NDArray[np.intp]], Array]

_CONTRACTION = 0.5  # of the fixed-point map on its ball; any value below one proves uniqueness
_LEAST_STEP = 1e-7  # of the path: shorter certified steps mean a singularity this near
_MOST_STEPS = 4000
_POLISH = 2  # Newton steps after the last, which leave rounding only


@dataclass(frozen=True)
class Followed:
    """Where a batch of followed solutions ended.

    Attributes:
        phi: Angles, shape (N, 3), rad.
        reached: Fraction of the path covered, shape (N,); one where the goal was reached.
    """

    phi: Array
    reached: Array


def follow(path: Path, start: ArrayLike) -> Followed:
    """Carry assemblies along closures that change from t = 0 to t = 1.

    Args:
        path: Gives the closures C, shape (5, 3, n), at t, shape (n,), of the members of the batch with indices, shape (n,).
        start: Angles that close at t = 0, shape (N, 3), rad.

    Returns:
        Angles at the end of the path, or where it met a singularity.
    """
    # impossible lengths on the way give closures that are not numbers; they certify nothing, which ends the path there
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        return _follow(path, np.array(np.asarray(start, float).T))


def _follow(path: Path, phi: Array) -> Followed:
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
        good = (quality <= _CONTRACTION) & (moved <= reach)
        done = active[good]
        phi[:, done] = new[:, good]
        reached[done] = np.where(dt[good] == 1.0 - t[good], 1.0, t[good] + dt[good])
        stride[active] = dt * np.clip(0.8 * _CONTRACTION / np.maximum(quality, 1e-12), 0.05, 4.0)
        stride[active[~good & (quality <= _CONTRACTION)]] *= 0.5
        C[:, :, good] = goal[:, :, good]
        keep = (reached[active] < 1.0) & (stride[active] > _LEAST_STEP)
        active, C = active[keep], C[:, :, keep]
    return _polish(path, phi, reached)


def _solve(C: Array, phi: Array) -> tuple[Array, Array]:
    """Newton from the present angles, three steps; the angles, and how far they moved, shape (n,)."""
    new = phi
    for _ in range(3):
        new = new + newton_step(C, new)[0]
    return new, np.sqrt(np.sum((new - phi) ** 2, axis=0))


def _polish(path: Path, phi: Array, reached: Array) -> Followed:
    whole = np.flatnonzero(reached == 1.0)
    C = path(np.ones(whole.size), whole)
    new = phi[:, whole]
    for _ in range(_POLISH):
        new = new + newton_step(C, new)[0]
    phi[:, whole] = new
    return Followed(phi.T.copy(), reached)


def _certify(C: Array, middle: Array, end: Array, phi: Array) -> tuple[Array, Array]:
    """Radius of the ball and contraction of the fixed-point map on it, over one step; infinite where J is singular.

    Args:
        C: Closure at the beginning, shape (5, 3, n).
        middle: Its change to the middle of the step, same shape.
        end: Its change to the end.
        phi: Angles, shape (3, n).

    Returns:
        Radius, rad, and contraction, each shape (n,).
    """
    cosine, sine = np.cos(phi), np.sin(phi)
    p, q = closure_slopes(C, cosine, sine)
    determinant = p[0] * p[1] * p[2] + q[0] * q[1] * q[2]
    turn, after = np.array([1, 2, 0]), np.array([2, 0, 1])
    squares = (p[turn] * p[after]) ** 2 + (q * p[after]) ** 2 + (q * q[turn]) ** 2
    beta = np.sqrt(np.sum(squares, axis=0)) / np.abs(determinant)
    linear, quadratic = 4 * middle - end, 2 * end - 4 * middle
    parts = [closure_values(item, cosine, sine) for item in (C, linear, quadratic)]
    radius = 2 * np.sum([_size(solve_cyclic(p, q, part, determinant)) for part in parts], axis=0)
    spread = np.abs(linear) + np.abs(quadratic)
    first, second = spread[1] + spread[3] + spread[4], spread[2] + spread[3] + spread[4]
    quality = beta * (_curvature(np.abs(C) + spread) * radius + np.hypot(_size(first), _size(second)))
    return radius, np.where(np.isfinite(quality), quality, np.inf)


def _size(rows: Array) -> Array:
    """Norm over the three rows, shape (n,)."""
    return np.sqrt(np.sum(rows**2, axis=0))


def _curvature(bound: Array) -> Array:
    """Bound of the change of the closure's Jacobian per radian, for coefficients bounded in size, shape (n,)."""
    _, b, g, _, f = bound
    return np.sqrt(np.sum((b + f) ** 2 + (g + f) ** 2 + 2 * f**2, axis=0))


def worst_direction(J: ArrayLike, scale: ArrayLike = 1.0) -> tuple[float, int]:
    """How near a Jacobian of lengths is to losing rank, and by which length.

    Args:
        J: Derivative of lengths, one row each, shape (n, n).
        scale: Units of the columns, shape (n,).

    Returns:
        Smallest singular value of J / scale, and the index of the row with most of its left singular vector.
    """
    left, value, _ = np.linalg.svd(np.asarray(J, float) / np.asarray(scale, float))
    return float(value[-1]), int(np.argmax(np.abs(left[:, -1])))


def damped_newton(C: ArrayLike, edges: ArrayLike, start: ArrayLike, damping: float, count: int) -> tuple[Array, Array]:
    """The dissertation's own iteration, as printed, with its history.

    Args:
        C: Closure, shape (5, 3, ...), m².
        edges: Lengths between the upper nodes, shape (..., 3), m.
        start: Angles to start from, shape (..., 3), rad.
        damping: sigma.
        count: Number of iterations.

    Returns:
        Angles after the last iteration, shape (..., 3), rad, and the greatest |D - L| before the first iteration and
        after each, shape (count + 1, ...), m.

    Source: equations 3.12 to 3.14 and the update after them. It may leave the mode of its start; `follow` does not.
    """
    C, edge = np.asarray(C, float), np.moveaxis(np.asarray(edges, float), -1, 0)
    phi = np.moveaxis(np.asarray(start, float), -1, 0)
    history = []
    for k in range(count + 1):
        cosine, sine = np.cos(phi), np.sin(phi)
        distance = np.sqrt(closure_values(C, cosine, sine) + edge**2)
        history.append(np.max(np.abs(distance - edge), axis=0))
        if k < count:
            p, q = (slope / (2 * distance) for slope in closure_slopes(C, cosine, sine))
            determinant = p[0] * p[1] * p[2] + q[0] * q[1] * q[2]
            phi = phi + damping * solve_cyclic(p, q, edge - distance, determinant)
    return np.moveaxis(phi, 0, -1), np.array(history)
