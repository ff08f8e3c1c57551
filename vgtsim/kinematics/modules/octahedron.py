"""The longeron-actuated octahedral module, a Stewart platform (section 3.4); all its lengths may differ.

Frame B sits on the base triangle n1 n2 n3 and frame T on the top triangle n4 n5 n6, each as in `triangle`.
Its canonical input is the pose: rotation R_BT and origin P_BT of frame T in frame B, from which everything
follows in closed form. `roll_pitch_yaw` turns the rotation into three angles. The conventional input is the
six longeron lengths

    l1 = n1 n4, l2 = n2 n5, l3 = n3 n6, l4 = n3 n4, l5 = n1 n5, l6 = n2 n6.

Arrays carry any leading batch dimensions, written `...`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import AssemblyError
from vgtsim.kinematics.closure import (
    LOWER,
    Circles,
    circle_angles,
    circle_nodes,
    closure_coefficients,
    edge_jacobian,
    make_circles,
    place_circles,
)
from vgtsim.kinematics.conditioning import invert_sound
from vgtsim.kinematics.mode_following import Followed, follow, worst_direction
from vgtsim.kinematics.triangle import triangle_frame, triangle_nodes
from vgtsim.kinematics.vectors import cross

Array = NDArray[np.float64]

# corner of the base and of the top of l1 to l6 (3.27)
LEGS = np.array([[0, 0], [1, 1], [2, 2], [2, 0], [0, 1], [1, 2]])
STATIC_TOLERANCE = 1e-9  # m: rounding of a pose that was meant to lie in the module's subspace


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
    def actuated(self) -> NDArray[np.intp]:
        """Indices of the actuated longerons, shape (6 - k,)."""
        return np.array([i for i, length in enumerate(self.static) if length is None], dtype=np.intp)

    @cached_property
    def radius(self) -> float:
        """RMS distance of the top nodes from their centroid, m: the unit to weigh rotations in."""
        return float(np.sqrt(np.mean(np.sum(self.top_nodes**2, axis=-1))))


def top_nodes(geometry: OctahedronGeometry, R: ArrayLike, P: ArrayLike) -> Array:
    """Nodes of the top triangle in frame B.

    Args:
        geometry: Fixed dimensions.
        R: R_BT, shape (..., 3, 3).
        P: P_BT, shape (..., 3), m.

    Returns:
        n4, n5, n6, shape (..., 3, 3), m.

    Source: equations 3.25 and 3.26.
    """
    return geometry.top_nodes @ np.swapaxes(np.asarray(R, float), -1, -2) + np.asarray(P, float)[..., None, :]


def lengths(geometry: OctahedronGeometry, R: ArrayLike, P: ArrayLike) -> Array:
    """All six longeron lengths of a pose, whatever the static ones should be.

    Args:
        geometry: Fixed dimensions.
        R: R_BT, shape (..., 3, 3).
        P: P_BT, shape (..., 3), m.

    Returns:
        l1 to l6, shape (..., 6), m.

    Source: equation 3.27.
    """
    top = top_nodes(geometry, R, P)
    return np.linalg.norm(top[..., LEGS[:, 1], :] - geometry.base_nodes[LEGS[:, 0]], axis=-1)


def inverse(geometry: OctahedronGeometry, R: ArrayLike, P: ArrayLike, tolerance: float = STATIC_TOLERANCE) -> Array:
    """Inverse solution: the longeron lengths of a pose that the module can take.

    Args:
        geometry: Fixed dimensions.
        R: R_BT, shape (..., 3, 3).
        P: P_BT, shape (..., 3), m.
        tolerance: Greatest error of a static longeron's length, m.

    Returns:
        l1 to l6, shape (..., 6), m.

    Raises:
        AssemblyError: A static longeron would need another length: the pose lies outside the (6 -
            k)-dimensional subspace of the module. The residual is the greatest such error; the longeron is
            named.

    Source: section 3.4.2.
    """
    result = lengths(geometry, R, P)
    fixed = np.array([np.nan if item is None else item for item in geometry.static])
    error = np.where(np.isnan(fixed), 0.0, np.abs(result - fixed))
    if np.any(error > tolerance):
        worst = np.unravel_index(int(np.argmax(error)), error.shape)
        leg, freedom = int(worst[-1]), geometry.actuated.size
        needs = f"static longeron l{leg + 1} would be {result[worst]:.6g} m"
        raise AssemblyError(
            "octahedron", float(error[worst]), f"pose outside the {freedom}-dimensional subspace: {needs}"
        )
    return result


def all_lengths(geometry: OctahedronGeometry, actuated: ArrayLike) -> Array:
    """Join the lengths of the actuated longerons with those of the static ones.

    Args:
        geometry: Fixed dimensions.
        actuated: Lengths of the actuated longerons in order, shape (..., 6 - k), m.

    Returns:
        l1 to l6, shape (..., 6), m.
    """
    moving = np.asarray(actuated, float)
    result = np.empty((*moving.shape[:-1], 6))
    result[...] = [0.0 if item is None else item for item in geometry.static]
    result[..., geometry.actuated] = moving
    return result


def home(geometry: OctahedronGeometry, longerons: ArrayLike) -> tuple[Array, Array]:
    """A pose on the working mode for about these lengths: top parallel to base, top nodes over base edges.

    Args:
        geometry: Fixed dimensions.
        longerons: l1 to l6, shape (..., 6), m.

    Returns:
        R_BT, shape (..., 3, 3), and P_BT, shape (..., 3), m; its own lengths are only near the given ones.
    """
    base, top = geometry.base_nodes[:, :2], geometry.top_nodes[:, :2]
    middle = (base[LOWER[:, 0]] + base[LOWER[:, 1]]) / 2
    cross = np.sum(top[:, 0] * middle[:, 1] - top[:, 1] * middle[:, 0])
    yaw = np.arctan2(cross, np.sum(top * middle))
    R = np.array([[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    plan = (geometry.top_nodes @ R.T)[LEGS[:, 1]] - geometry.base_nodes[LEGS[:, 0]]
    square = np.mean(np.asarray(longerons, float) ** 2, axis=-1)
    P = np.zeros((*square.shape, 3))
    P[..., 2] = np.sqrt(np.maximum(square - np.mean(np.sum(plan**2, axis=-1)), square / 10))
    return np.broadcast_to(R, (*square.shape, 3, 3)), P


def forward(
    geometry: OctahedronGeometry, longerons: ArrayLike, start: tuple[ArrayLike, ArrayLike] | None = None
) -> tuple[Array, Array]:
    """Forward solution on the assembly mode of its start.

    The path from the lengths of the start to those wanted is straight in the foot points and altitudes of the
    equivalent mechanism (3.6 and 3.7), so every longeron pair on it assembles.

    Args:
        geometry: Fixed dimensions.
        longerons: l1 to l6, shape (..., 6), m.
        start: R_BT, shape (..., 3, 3), and P_BT, shape (..., 3), m, of a pose on the wanted mode; absent for
            `home`.

    Returns:
        R_BT, shape (..., 3, 3), and P_BT, shape (..., 3), m.

    Raises:
        AssemblyError: A longeron pair does not assemble, or a singularity lies between the start and the
            given lengths: a solution beyond it would be on another mode. The detail has the smallest singular
            value and the member.

    Source: equations 3.5 to 3.18.
    Differs: undamped steps, each proved to stay on the mode; the dissertation limits the range of phi
    instead.
    """
    wanted = np.asarray(longerons, float)
    R, P = home(geometry, wanted) if start is None else start
    first = top_nodes(geometry, R, P)
    batch = np.broadcast_shapes(wanted.shape[:-1], first.shape[:-2])
    goal = _circles(geometry, np.broadcast_to(wanted, (*batch, 6)).reshape(-1, 6))
    nodes = np.broadcast_to(first, (*batch, 3, 3)).reshape(-1, 3, 3)
    begin, result = _follow(geometry, goal, nodes)
    if result.reached.min(initial=1.0) < 1.0:
        raise _singular(geometry, wanted, begin, goal, result.phi, result.reached)
    R, P = triangle_frame(circle_nodes(goal, result.phi))
    return R.reshape(*batch, 3, 3), P.reshape(*batch, 3)


def advance(geometry: OctahedronGeometry, longerons: Array, start: tuple[Array, Array]) -> tuple[Array, Array, Array]:
    """As `forward`, but reports how far it got where it met a singularity or impossible lengths.

    Args:
        geometry: Fixed dimensions.
        longerons: l1 to l6, shape (N, 6), m.
        start: R_BT, shape (N, 3, 3), and P_BT, shape (N, 3), m, on the wanted mode.

    Returns:
        R_BT and P_BT where it ended, and the fraction of the way covered, shape (N,).
    """
    with np.errstate(invalid="ignore"):
        goal = place_circles(geometry.base_nodes, longerons, LOWER)
        begin, result = _follow(geometry, goal, top_nodes(geometry, *start))
        t = result.reached[:, None]
        radius = np.where(t == 1.0, goal.radius, (1 - t) * begin.radius + t * goal.radius)
        centre = np.where(
            t[..., None] == 1.0, goal.centre, (1 - t[..., None]) * begin.centre + t[..., None] * goal.centre
        )
        R, P = triangle_frame(circle_nodes(Circles(centre, goal.inward, radius), result.phi))
    return R, P, result.reached


def _follow(geometry: OctahedronGeometry, goal: Circles, nodes: Array) -> tuple[Circles, Followed]:
    """Follow from top nodes, shape (N, 3, 3), to the circles of the goal; returns the circles of the start too."""
    begin = _circles(geometry, _leg_lengths(geometry, nodes))
    first, last = closure_coefficients(begin, geometry.top), closure_coefficients(goal, geometry.top)
    # centres and radii are linear in t and the closure is a quadratic form in them
    change = Circles(goal.centre - begin.centre, begin.inward, goal.radius - begin.radius)
    square = closure_coefficients(change, np.zeros(3))
    slope = last - first - square

    def path(t: Array, index: NDArray[np.intp]) -> Array:
        return first[..., index] + t * (slope[..., index] + t * square[..., index])

    return begin, follow(path, circle_angles(begin, nodes))


def _circles(geometry: OctahedronGeometry, longerons: Array) -> Circles:
    return make_circles(geometry.base_nodes, longerons, LOWER, "octahedron")


def _leg_lengths(geometry: OctahedronGeometry, nodes: Array) -> Array:
    return np.linalg.norm(nodes[..., LEGS[:, 1], :] - geometry.base_nodes[LEGS[:, 0]], axis=-1)


def _singular(
    geometry: OctahedronGeometry, wanted: Array, begin: Circles, goal: Circles, phi: Array, reached: Array
) -> AssemblyError:
    """The error of the member of the batch that got least far."""
    worst = int(np.argmin(reached))
    t = reached[worst]
    centre = (1 - t) * begin.centre[worst] + t * goal.centre[worst]
    here = Circles(centre, begin.inward[worst], (1 - t) * begin.radius[worst] + t * goal.radius[worst])
    R, P = triangle_frame(circle_nodes(here, phi[worst]))
    nodes = circle_nodes(Circles(goal.centre[worst], goal.inward[worst], goal.radius[worst]), phi[worst])
    gap = np.linalg.norm(nodes[[1, 2, 0]] - nodes, axis=-1) - geometry.top
    value, member = singularity(geometry, R, P)
    row = np.broadcast_to(wanted, (reached.size, 6))[worst] if wanted.ndim == 1 else wanted.reshape(-1, 6)[worst]
    detail = (
        f"the mode of the start ends {t:.4f} of the way to {np.array2string(row, precision=4)} m: "
        f"smallest singular value {value:.2g}, longeron l{member + 1}"
    )
    return AssemblyError("octahedron", float(np.max(np.abs(gap))), detail)


def length_jacobian(geometry: OctahedronGeometry, R: ArrayLike, P: ArrayLike) -> tuple[Array, Array]:
    """Longeron lengths and their derivative with respect to the motion of the top.

    Args:
        geometry: Fixed dimensions.
        R: R_BT, shape (..., 3, 3).
        P: P_BT, shape (..., 3), m.

    Returns:
        l1 to l6, shape (..., 6), m, and dl/dtwist, shape (..., 6, 6): per velocity of T's origin, then per
        angular velocity of T, both in frame B.
    """
    top = top_nodes(geometry, R, P)[..., LEGS[:, 1], :]
    return leg_jacobian(geometry.base_nodes[LEGS[:, 0]], top, P)


def leg_jacobian(lower: ArrayLike, upper: ArrayLike, origin: ArrayLike) -> tuple[Array, Array]:
    """Lengths of legs and their derivative with respect to the motion of the body at their upper ends.

    Args:
        lower: Lower ends, shape (..., 6, 3), m.
        upper: Upper ends, shape (..., 6, 3), m.
        origin: Reference point of the body, shape (..., 3), m, in the same frame.

    Returns:
        Lengths, shape (..., 6), m, and their derivative per velocity of the reference point, then per angular
        velocity, shape (..., 6, 6).
    """
    upper = np.asarray(upper, float)
    span = upper - np.asarray(lower, float)
    length = np.sqrt(np.einsum("...i,...i->...", span, span))
    unit = span / length[..., None]
    arm = upper - np.asarray(origin, float)[..., None, :]
    return length, np.concatenate([unit, cross(arm, unit)], axis=-1)


def twist_jacobian(geometry: OctahedronGeometry, R: ArrayLike, P: ArrayLike) -> Array:
    """Motion of the top per unit rate of each actuated longeron; static longerons keep their length.

    Args:
        geometry: Fixed dimensions.
        R: R_BT, shape (..., 3, 3).
        P: P_BT, shape (..., 3), m.

    Returns:
        Velocity of T's origin over angular velocity of T in frame B, shape (..., 6, 6 - k).

    Raises:
        SingularPoseError: The pose is singular.
    """
    _, J = length_jacobian(geometry, R, P)
    return invert_sound(J, [1.0, 1.0, 1.0, *(geometry.radius,) * 3], lambda _: "octahedron")[..., geometry.actuated]


def singularity(geometry: OctahedronGeometry, R: ArrayLike, P: ArrayLike) -> tuple[float, int]:
    """How near a pose is to a singularity, and which longeron is the worst of it.

    Args:
        geometry: Fixed dimensions.
        R: R_BT, shape (3, 3).
        P: P_BT, shape (3,), m.

    Returns:
        Smallest singular value of dl/dtwist with rotations in units of `OctahedronGeometry.radius` (a pure number), and
        the index of the longeron that has most of the length change lost there.
    """
    _, J = length_jacobian(geometry, R, P)
    return worst_direction(J, [1.0, 1.0, 1.0, *(geometry.radius,) * 3])


def angles(geometry: OctahedronGeometry, R: ArrayLike, P: ArrayLike) -> Array:
    """Angles of the equivalent mechanism of a pose R_BT, shape (..., 3, 3), and P_BT, shape (..., 3), m.

    Returns:
        phi_1 to phi_3, shape (..., 3), rad.
    """
    nodes = top_nodes(geometry, R, P)
    return circle_angles(_circles(geometry, _leg_lengths(geometry, nodes)), nodes)


def closure(geometry: OctahedronGeometry, longerons: ArrayLike) -> tuple[Circles, Array]:
    """Equivalent mechanism and closure, C of shape (5, 3, ...), m², of longerons, shape (..., 6), m.

    Raises:
        AssemblyError: A longeron pair does not assemble.
    """
    circles = _circles(geometry, np.asarray(longerons, float))
    return circles, closure_coefficients(circles, geometry.top)


def angle_jacobian(geometry: OctahedronGeometry, R: ArrayLike, P: ArrayLike) -> Array:
    """The matrix of the forward iteration at a pose.

    Args:
        geometry: Fixed dimensions.
        R: R_BT, shape (..., 3, 3).
        P: P_BT, shape (..., 3), m.

    Returns:
        dD/dphi, shape (..., 3, 3), m/rad.

    Source: equation 3.14.
    """
    nodes = top_nodes(geometry, R, P)
    circles = _circles(geometry, _leg_lengths(geometry, nodes))
    return edge_jacobian(closure_coefficients(circles, geometry.top), geometry.top, circle_angles(circles, nodes))
