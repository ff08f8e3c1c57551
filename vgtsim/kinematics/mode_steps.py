"""Steps along an assembly mode, compiled: one cell at a time, see `mode_following`.

A closure is C of shape (5, 3), m², as in `closure`. It changes with t, from 0 to 1, in one of two ways: as the table's
C + t (C' + t C''), shape (N, 3, 5, 3); or, where the table is empty, as the cell over a triangle whose sides go straight
from the first to the second of the ends, shape (N, 2, 3), m. Rows of the room to work in: cosines, sines, p and q of
`closure_slopes`, and a right side.
"""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array
from vgtsim.compilation import compiled

_KANTOROVICH = 0.5  # beta K eta; up to this value Newton's limit is the only assembly in its ball
_TARGET = 0.4  # what the next step is cut to: a little below, since the estimate is not exact
_NEWTON_STEPS = 4  # of a step: enough to stay in the next certified ball; the end is polished apart
_LEAST_STEP = 1e-7  # of the path: shorter certified steps mean a singularity this near
_MOST_STEPS = 4000  # certified ones: a path that needs more creeps along a singularity
_ROUNDING = 1e-10  # rad: a ball no smaller than the rounding of the angles
_POLISH = 2  # Newton steps after the last, which leave rounding only


@compiled
def follow_cells(table: Array, ends: Array, sides: Array, edges: Array, phi: Array, reached: Array) -> None:
    """Carry angles, shape (N, 3), rad, in place, as far as is proved; `reached` is the part of the way covered, shape (N,).

    Sides are the six longerons over the triangle of `ends`, and edges those between its upper nodes, m.
    """
    C, room, new = np.empty((3, 5, 3)), np.empty((5, 3)), np.empty(3)
    for n in range(len(phi)):
        _close(n, table, ends, sides, edges, 0.0, C[0])
        t, stride, count = 0.0, 1.0, 0
        while t < 1.0 and stride > _LEAST_STEP and count < _MOST_STEPS:
            count += 1
            dt = min(stride, 1.0 - t)
            _close(n, table, ends, sides, edges, t + dt / 2, C[1])
            _close(n, table, ends, sides, edges, t + dt, C[2])
            radius, quality = _certify(C, phi[n], room)
            new[:] = phi[n]
            moved = _iterate(C[2], new, _NEWTON_STEPS, room)
            stride = dt * min(max((_TARGET / max(quality, 1e-12)) ** 0.6, 0.1), 4.0)
            if quality <= _KANTOROVICH:
                if moved <= radius:
                    phi[n], C[0] = new, C[2]
                    t = 1.0 if dt == 1.0 - t else t + dt
                else:
                    stride *= 0.5
        if t == 1.0:
            _close(n, table, ends, sides, edges, 1.0, C[0])
            _iterate(C[0], phi[n], _POLISH, room)
        reached[n] = t


@compiled
def certify_cells(C: Array, half: Array, phi: Array, radius: Array, quality: Array) -> None:
    """As `certify_box`: closures (N, 5, 3), half edges (3,), m², angles (N, 3), rad, and two results (N,)."""
    room, column, inverse, spread = np.empty((5, 3)), np.empty(3), np.empty((3, 3)), np.zeros((5, 3))
    for n in range(len(phi)):
        determinant = _set_slopes(C[n], phi[n], room)
        for j in range(3):
            room[4] = 0.0
            room[4, j] = 1.0
            _solve(room, determinant, column)
            inverse[:, j] = np.abs(column)
        eta, most = 0.0, 0.0
        for i in range(3):
            eta = _greater(eta, inverse[i, 0] * half[0] + inverse[i, 1] * half[1] + inverse[i, 2] * half[2])
        radius[n] = 2 * eta + _ROUNDING
        for j in range(3):
            own, other, mixed = _bound_row(j, C[n], spread, room, radius[n])
            column[j] = own + other + 2 * mixed
        for i in range(3):
            most = _greater(most, inverse[i, 0] * column[0] + inverse[i, 1] * column[1] + inverse[i, 2] * column[2])
        quality[n] = most * eta if np.isfinite(most * eta) else np.inf


@compiled
def _greater(first: float, second: float) -> float:
    """The greater of two, and no number where one is none."""
    return second if second > first or np.isnan(second) else first


@compiled
def _close(n: int, table: Array, ends: Array, sides: Array, edges: Array, t: float, C: Array) -> None:
    """The closure of cell n at t."""
    if len(table) == 0:
        _close_over(ends[n], sides, edges, t, C)
        return
    for i in range(5):
        for k in range(3):
            C[i, k] = table[n, 0, i, k] + t * (table[n, 1, i, k] + t * table[n, 2, i, k])


@compiled
def _close_over(ends: Array, sides: Array, edges: Array, t: float, C: Array) -> None:
    """As `place_triangle`, `place_circles` over `UPPER` and `closure_coefficients`; no numbers where the lengths do not close."""
    s = ends[0] + t * (ends[1] - ends[0])
    foot = (s[2] ** 2 + s[1] ** 2 - s[0] ** 2) / (2 * s[2])
    corner = np.array([[s[2], 0.0], [foot, np.sqrt(s[1] ** 2 - foot**2)], [0.0, 0.0]])
    circle = np.empty((3, 5))  # centre, direction inward, radius
    for k in range(3):
        x, y = corner[(k + 1) % 3] - corner[k]
        side = np.sqrt(x**2 + y**2)
        x, y = x / side, y / side
        foot = (side**2 + sides[3 + k] ** 2 - sides[k] ** 2) / (2 * side)
        circle[k, 0], circle[k, 1] = corner[k, 0] + foot * x, corner[k, 1] + foot * y
        circle[k, 2], circle[k, 3], circle[k, 4] = -y, x, np.sqrt(sides[3 + k] ** 2 - foot**2)
    for k in range(3):
        here, there = circle[k], circle[(k + 1) % 3]
        x, y, h, h2 = there[0] - here[0], there[1] - here[1], here[4], there[4]
        C[0, k] = x**2 + y**2 + h**2 + h2**2 - edges[k] ** 2
        C[1, k] = -2 * h * (x * here[2] + y * here[3])
        C[2, k] = 2 * h2 * (x * there[2] + y * there[3])
        C[4, k] = -2 * h * h2
        C[3, k] = C[4, k] * (here[2] * there[2] + here[3] * there[3])


@compiled
def _certify(C: Array, phi: Array, room: Array) -> tuple[float, float]:
    """Radius of the ball that holds the assembly, rad, and beta K eta, over a step; infinite where J is singular.

    C are the closures at the beginning, the middle and the end of the step, shape (3, 5, 3).
    """
    determinant = _set_slopes(C[0], phi, room)
    p, q = room[2], room[3]
    middle, end = C[1] - C[0], C[2] - C[0]
    linear, quadratic = 4 * middle - end, 2 * end - 4 * middle
    spread = np.abs(linear) + np.abs(quadratic)
    square, first, second = 0.0, 0.0, 0.0
    for k in range(3):
        p1, p2 = p[(k + 1) % 3], p[(k + 2) % 3]
        square += (p1 * p2) ** 2 + (q[k] * p2) ** 2 + (q[k] * q[(k + 1) % 3]) ** 2
        first += (spread[1, k] + spread[3, k] + spread[4, k]) ** 2
        second += (spread[2, k] + spread[3, k] + spread[4, k]) ** 2
    beta = np.sqrt(square) / abs(determinant)
    eta = _measure(C[0], room, determinant) + _measure(linear, room, determinant)
    eta += _measure(quadratic, room, determinant)
    # the Jacobian at other t of the step: |J_t - J| bounds how much its inverse and eta may grow
    growth = 1.0 - beta * np.sqrt(first + second)
    radius, square = 2 * eta / growth + _ROUNDING, 0.0
    for k in range(3):
        own, other, mixed = _bound_row(k, C[0], spread, room, radius)
        square += own**2 + other**2 + 2 * mixed**2
    quality = beta * np.sqrt(square) * (eta / growth**2)
    return radius, quality if np.isfinite(quality) and growth > 0 else np.inf


@compiled
def _measure(C: Array, room: Array, determinant: float) -> float:
    """Size of J^-1 F of a closure, rad."""
    step = np.empty(3)
    _set_values(C, room)
    _solve(room, determinant, step)
    return np.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)


@compiled
def _bound_row(k: int, C: Array, spread: Array, room: Array, radius: float) -> tuple[float, float, float]:
    """Bounds of row k's second derivatives by its own angle, by the next, and by both, for a closure within its spread."""
    c, s, c2, s2 = room[0, k], room[1, k], room[0, (k + 1) % 3], room[1, (k + 1) % 3]
    b, g, e, f = C[1, k], C[2, k], C[3, k], C[4, k]
    both = spread[3, k] + spread[4, k]
    # third derivatives
    further = radius * (abs(b) + spread[1, k] + abs(g) + spread[2, k] + 4 * (abs(f) + spread[4, k]))
    own = abs(b * c + e * c * c2 + f * s * s2) + spread[1, k] + both
    other = abs(g * c2 + e * c * c2 + f * s * s2) + spread[2, k] + both
    return own + further, other + further, abs(e * s * s2 + f * c * c2) + both + further


@compiled
def _iterate(C: Array, phi: Array, count: int, room: Array) -> float:
    """Undamped Newton steps from angles, in place, and how far these moved, rad.

    Source: equation 3.14. Differs: on D² rather than D, which has no square root and the same solutions.
    """
    step, begin = np.empty(3), phi.copy()
    for _ in range(count):
        determinant = _set_slopes(C, phi, room)
        _set_values(C, room)
        _solve(room, determinant, step)
        phi -= step
    begin -= phi
    return np.sqrt(begin[0] ** 2 + begin[1] ** 2 + begin[2] ** 2)


@compiled
def _set_slopes(C: Array, phi: Array, room: Array) -> float:
    """Cosines, sines, p and q of angles; the determinant."""
    for k in range(3):
        room[0, k], room[1, k] = np.cos(phi[k]), np.sin(phi[k])
    for k in range(3):
        c, s, c2, s2 = room[0, k], room[1, k], room[0, (k + 1) % 3], room[1, (k + 1) % 3]
        room[2, k] = C[4, k] * c * s2 - s * (C[1, k] + C[3, k] * c2)
        room[3, k] = C[4, k] * s * c2 - s2 * (C[2, k] + C[3, k] * c)
    p, q = room[2], room[3]
    return p[0] * p[1] * p[2] + q[0] * q[1] * q[2]


@compiled
def _set_values(C: Array, room: Array) -> None:
    """F of a closure as the right side."""
    for k in range(3):
        c, s, c2, s2 = room[0, k], room[1, k], room[0, (k + 1) % 3], room[1, (k + 1) % 3]
        room[4, k] = C[0, k] + C[1, k] * c + c2 * (C[2, k] + C[3, k] * c) + C[4, k] * s * s2


@compiled
def _solve(room: Array, determinant: float, out: Array) -> None:
    """Solution of p_k x_k + q_k x_(k+1) = right_k, shape (3,); the determinant is p1 p2 p3 + q1 q2 q3."""
    p, q, right = room[2], room[3], room[4]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        out[k] = (right[k] * p[i] * p[j] - q[k] * right[i] * p[j] + q[k] * q[i] * right[j]) / determinant
