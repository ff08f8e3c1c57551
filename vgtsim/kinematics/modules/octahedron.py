"""The longeron-actuated octahedral module, a Stewart platform (section 3.4); all its lengths may differ.

Frame B sits on the base triangle n1 n2 n3 and frame T on the top triangle n4 n5 n6, each as in `triangle`. The
canonical input is the pose: R_BT, shape (..., 3, 3), and P_BT, shape (..., 3), m, the rotation and the origin of T in
B. In this file R and P are this pose. The conventional input is the six longeron lengths, shape (..., 6), m:

    l1 = n1 n4, l2 = n2 n5, l3 = n3 n6, l4 = n3 n4, l5 = n1 n5, l6 = n2 n6.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.errors import AssemblyError
from vgtsim.kinematics.closure import (
    LOWER,
    Circles,
    circle_angles,
    circle_nodes,
    closure_coefficients,
    make_circles,
    place_circles,
    triangle_frame,
    triangle_nodes,
)
from vgtsim.kinematics.mode_following import follow_mode, worst_direction
from vgtsim.kinematics.roll_pitch_yaw import rotate_upright
from vgtsim.kinematics.vectors import cross

# corner of the base and of the top of l1 to l6 (3.27)
LEGS = np.array([[0, 0], [1, 1], [2, 2], [2, 0], [0, 1], [1, 2]])


@dataclass(frozen=True)
class OctahedronGeometry:
    """Fixed dimensions of the module.

    Attributes:
        base: Sides n1 n2, n2 n3, n3 n1 of the base triangle, m.
        top: Sides n4 n5, n5 n6, n6 n4 of the top triangle, m.
        static: For l1 to l6 the length of a static longeron, m, or None for an actuated one.
    """

    base: tuple[float, float, float]
    top: tuple[float, float, float]
    static: tuple[float | None, ...] = (None,) * 6

    @cached_property
    def base_nodes(self) -> Array:
        """n1, n2, n3 in frame B, shape (3, 3), m."""
        return triangle_nodes(self.base)

    @cached_property
    def top_nodes(self) -> Array:
        """n4, n5, n6 in frame T, shape (3, 3), m."""
        return triangle_nodes(self.top)

    @cached_property
    def twist_units(self) -> Array:
        """As the function of this name, of the top nodes."""
        return twist_units(self.top_nodes)


def twist_units(top: Array) -> Array:
    """Units of the columns of dl/dtwist, (6,): 1, and for turns the RMS distance of nodes, (3, 3), m, from their centroid."""
    radius = np.sqrt(np.mean(np.sum(top**2, axis=-1)))
    return np.array([1.0, 1.0, 1.0, radius, radius, radius])


def top_nodes(geometry: OctahedronGeometry, R: ArrayLike, P: ArrayLike) -> Array:
    """n4, n5, n6 in frame B, shape (..., 3, 3), m, of a pose (3.25 and 3.26)."""
    return geometry.top_nodes @ np.swapaxes(np.asarray(R, float), -1, -2) + np.asarray(P, float)[..., None, :]


def lengths(geometry: OctahedronGeometry, R: ArrayLike, P: ArrayLike) -> Array:
    """l1 to l6, shape (..., 6), m, of a pose, whatever the static ones should be (3.27)."""
    top = top_nodes(geometry, R, P)
    return np.linalg.norm(top[..., LEGS[:, 1], :] - geometry.base_nodes[LEGS[:, 0]], axis=-1)


def home(geometry: OctahedronGeometry, longerons: ArrayLike) -> tuple[Array, Array]:
    """A pose on the working mode: the top parallel to the base, its nodes over the base edges.

    The lengths of the pose are only near the given ones, l1 to l6, shape (..., 6), m.
    """
    base, top = geometry.base_nodes[:, :2], geometry.top_nodes[:, :2]
    middle = (base[LOWER[:, 0]] + base[LOWER[:, 1]]) / 2
    cross = np.sum(top[:, 0] * middle[:, 1] - top[:, 1] * middle[:, 0])
    R = rotate_upright(np.arctan2(cross, np.sum(top * middle)))
    plan = (geometry.top_nodes @ R.T)[LEGS[:, 1]] - geometry.base_nodes[LEGS[:, 0]]
    square = np.mean(np.asarray(longerons, float) ** 2, axis=-1)
    P = np.zeros((*square.shape, 3))
    # legs too short for an upright top begin a third of their length high, not in the base's plane, where they are singular
    P[..., 2] = np.sqrt(np.maximum(square - np.mean(np.sum(plan**2, axis=-1)), square / 10))
    return np.broadcast_to(R, (*square.shape, 3, 3)), P


def forward(
    geometry: OctahedronGeometry, longerons: ArrayLike, start: tuple[ArrayLike, ArrayLike] | None = None
) -> tuple[Array, Array]:
    """Forward solution: pose of longerons l1 to l6, shape (..., 6), m, on the assembly mode of its start.

    The path goes from the lengths of the start (`home` if there is none) to the given lengths. It is straight in the foot
    points and altitudes of the equivalent mechanism (3.6 and 3.7), so every longeron pair on it assembles.

    Raises:
        AssemblyError: A longeron pair does not assemble, or a singularity lies between. The detail has the smallest
            singular value and the member.

    Source: equations 3.5 to 3.18.
    Differs: undamped steps, each proved to stay on the mode; the dissertation limits the range of phi instead.
    """
    wanted = np.asarray(longerons, float)
    R, P = (np.asarray(item, float) for item in (home(geometry, wanted) if start is None else start))
    batch = np.broadcast_shapes(wanted.shape[:-1], P.shape[:-1])
    flat = np.broadcast_to(wanted, (*batch, 6)).reshape(-1, 6)
    begin = np.broadcast_to(R, (*batch, 3, 3)).reshape(-1, 3, 3), np.broadcast_to(P, (*batch, 3)).reshape(-1, 3)
    closure(geometry, flat)  # refuses impossible lengths by name
    R, P, reached = advance(geometry, flat, begin)
    if reached.min(initial=1.0) < 1.0:
        worst = int(np.argmin(reached))
        value, member = singularity(geometry, R[worst], P[worst])
        gap = np.abs(lengths(geometry, R[worst], P[worst]) - flat[worst]).max()
        way = f"{reached[worst]:.4f} of the way to {np.array2string(flat[worst], precision=4)} m"
        detail = f"the mode of the start ends {way}: smallest singular value {value:.2g}, longeron l{member + 1}"
        raise AssemblyError("octahedron", float(gap), detail)
    return R.reshape(*batch, 3, 3), P.reshape(*batch, 3)


def advance(geometry: OctahedronGeometry, longerons: Array, start: tuple[Array, Array]) -> tuple[Array, Array, Array]:
    """As `forward`, from lengths and starts of N modules, but no error.

    Returns:
        R_BT and P_BT where each ended, and the fraction of the way covered, shape (N,): below one where it met a
        singularity or impossible lengths.
    """
    with np.errstate(invalid="ignore"):
        goal = place_circles(geometry.base_nodes, longerons, LOWER)
        begin, first = closure(geometry, lengths(geometry, *start))
        # centres and radii are linear in t and the closure is a quadratic form in them
        change = Circles(goal.centre - begin.centre, begin.inward, goal.radius - begin.radius)
        square = closure_coefficients(change, np.zeros(3))
        slope = closure_coefficients(goal, geometry.top) - first - square
        result = follow_mode(first, slope, square, circle_angles(begin, top_nodes(geometry, *start)))
        t = result.reached[:, None]
        radius = (1 - t) * begin.radius + t * goal.radius
        centre = (1 - t[..., None]) * begin.centre + t[..., None] * goal.centre
        R, P = triangle_frame(circle_nodes(Circles(centre, goal.inward, radius), result.phi))
    return R, P, result.reached


def length_jacobian(geometry: OctahedronGeometry, R: ArrayLike, P: ArrayLike) -> tuple[Array, Array]:
    """l1 to l6, shape (..., 6), m, of a pose, and dl/dtwist, shape (..., 6, 6).

    The twist is the velocity of the origin of T, then the angular velocity of T, in frame B.
    """
    top = top_nodes(geometry, R, P)[..., LEGS[:, 1], :]
    return leg_jacobian(geometry.base_nodes[LEGS[:, 0]], top, P)


def leg_jacobian(lower: ArrayLike, upper: ArrayLike, origin: ArrayLike) -> tuple[Array, Array]:
    """Lengths of legs, shape (..., 6), m, and their derivative by the motion of the body at the upper ends, (..., 6, 6).

    The motion is the velocity of a reference point of the body, then its angular velocity. Ends have shape (..., 6,
    3), the reference point, `origin`, (..., 3), m, in one frame.
    """
    upper = np.asarray(upper, float)
    span = upper - np.asarray(lower, float)
    length = np.sqrt(np.einsum("...i,...i->...", span, span))
    unit = span / length[..., None]
    arm = upper - np.asarray(origin, float)[..., None, :]
    return length, np.concatenate([unit, cross(arm, unit)], axis=-1)


def singularity(geometry: OctahedronGeometry, R: ArrayLike, P: ArrayLike) -> tuple[float, int]:
    """Smallest singular value of dl/dtwist in `twist_units`, a pure number, of a pose, and the longeron worst of it."""
    _, J = length_jacobian(geometry, R, P)
    return worst_direction(J, geometry.twist_units)


def closure(geometry: OctahedronGeometry, longerons: ArrayLike) -> tuple[Circles, Array]:
    """Equivalent mechanism and closure, C of shape (5, 3, ...), m², of longerons, shape (..., 6), m; errors as `make_circles`."""
    circles = make_circles(geometry.base_nodes, longerons, LOWER, "octahedron")
    return circles, closure_coefficients(circles, geometry.top)
