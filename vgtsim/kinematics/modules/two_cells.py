"""The general batten-actuated double-octahedral module (sections 3.2, 3.5.1, 3.5.2, 3.5.4): all its lengths may differ.

Frame B sits on the base triangle n1 n2 n3 and frame T on the top triangle n7 n8 n9, each as in `triangle`.
The actuators l1 = n4 n5, l2 = n5 n6, l3 = n6 n4 make the mid-plane. With a joint offset the upper longerons
start from n4' n5' n6', displaced by Ljo along the normal of the mid-plane. The longerons, numbered as in
figure 3.10, are

    L1 to L6 = n1 n4, n2 n5, n3 n6, n3 n4, n1 n5, n2 n6;  L7 to L12 = n5' n7, n6' n8, n4' n9, n4' n7, n5' n8,
    n6' n9.

A state is all six angles (phi_1 to phi_6): the lower three are the canonical input, the upper three follow by
the second closure and say which mode the upper cell is on. Arrays carry any leading batch dimensions, written
`...`.

The upper longerons and the top triangle are rigid, so the twist of the top follows from the velocities of n4', n5', n6' by
one linear system, the same matrix as that of a longeron-actuated octahedron; no derivative of the upper angles is needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.errors import AssemblyError
from vgtsim.kinematics import closure
from vgtsim.kinematics.closure import (
    LOWER,
    UPPER,
    Circles,
    circle_nodes,
    circle_tangents,
    closure_coefficients,
    edge_lengths,
    make_circles,
    place_circles,
    triangle_frame,
    triangle_nodes,
)
from vgtsim.kinematics.conditioning import invert_sound
from vgtsim.kinematics.mode_following import FollowedMode, follow_sides, follow_squares, worst_direction
from vgtsim.kinematics.modules.octahedron import leg_jacobian, twist_units

# corner of the mid-plane and of the top of L7 to L12
UPPER_LEGS = np.array([[1, 0], [2, 1], [0, 2], [0, 0], [1, 1], [2, 2]])


@dataclass(frozen=True)
class TwoCellGeometry:
    """Fixed dimensions of the module.

    Attributes:
        base: Sides n1 n2, n2 n3, n3 n1 of the base triangle, m.
        top: Sides n7 n8, n8 n9, n9 n7 of the top triangle, m.
        longerons: L1 to L12, m.
        joint_offset: Ljo, m.
    """

    base: tuple[float, float, float]
    top: tuple[float, float, float]
    longerons: tuple[float, ...]
    joint_offset: float = 0.0

    @cached_property
    def base_nodes(self) -> Array:
        """n1, n2, n3 in frame B, shape (3, 3), m."""
        return triangle_nodes(self.base)

    @cached_property
    def top_nodes(self) -> Array:
        """n7, n8, n9 in frame T, shape (3, 3), m."""
        return triangle_nodes(self.top)

    @cached_property
    def circles(self) -> Circles:
        """Circles of n4, n5, n6 in frame B (3.28 to 3.31)."""
        return make_circles(self.base_nodes, self.longerons[:6], LOWER, "double octahedron, lower cell")

    @cached_property
    def twist_units(self) -> Array:
        """As the function of this name, of the top nodes."""
        return twist_units(self.top_nodes)


def upper_circles(geometry: TwoCellGeometry, actuators: ArrayLike) -> Circles:
    """Circles of n7, n8, n9 in the frame of the mid-plane triangle n4' n5' n6', of l1 to l3, shape (..., 3), m.

    Raises:
        AssemblyError: The actuators do not form a triangle, or two longerons do not meet over one.

    Source: equations 3.34 to 3.44.
    """
    return make_circles(triangle_nodes(actuators), geometry.longerons[6:], UPPER, "double octahedron, upper cell")


def actuator_lengths(geometry: TwoCellGeometry, phi: ArrayLike) -> Array:
    """l1, l2, l3, shape (..., 3), m, of phi_1 to phi_3 or of a state, shape (..., 3) or (..., 6) (3.28, 3.32)."""
    return edge_lengths(mid_nodes(geometry, phi))


def mid_nodes(geometry: TwoCellGeometry, phi: ArrayLike) -> Array:
    """n4, n5, n6 in frame B, shape (..., 3, 3), m, of phi_1 to phi_3 or of a state, shape (..., 3) or (..., 6) (3.28).

    The primed nodes lie Ljo along the normal from them.
    """
    return circle_nodes(geometry.circles, np.asarray(phi, float)[..., :3])


def nodes(geometry: TwoCellGeometry, state: ArrayLike) -> Array:
    """n4, n5, n6, n4', n5', n6', n7, n8, n9 in frame B, shape (..., 9, 3), m, of a state (3.28 and 3.41)."""
    angles = np.asarray(state, float)
    mid = mid_nodes(geometry, angles)
    R, P = triangle_frame(mid)
    shift = geometry.joint_offset * R[..., :, 2]
    local = circle_nodes(upper_circles(geometry, edge_lengths(mid)), angles[..., 3:])
    top = local @ np.swapaxes(R, -1, -2) + (P + shift)[..., None, :]
    return np.concatenate([mid, mid + shift[..., None, :], top], axis=-2)


def home(geometry: TwoCellGeometry, actuators: ArrayLike) -> Array:
    """A state on the working mode: mid-plane nodes out, top above.

    The lengths of the state are only near the given ones, l1 to l3, shape (..., 3), m.

    Raises:
        AssemblyError: The upper cell cannot be assembled there.
    """
    mean = np.mean(np.asarray(actuators, float), axis=-1, keepdims=True)
    inset = np.mean(geometry.base) / 2 - mean  # 0.98 below: beside the flat pose at one, where no way begins
    lower = np.arccos(np.clip(inset / np.sqrt(3) / geometry.circles.radius, -0.98, 0.98))
    length = actuator_lengths(geometry, lower)
    circles = upper_circles(geometry, length)
    inset = np.mean(length, axis=-1, keepdims=True) / 2 - np.mean(geometry.top)
    guess = np.arccos(np.clip(inset / np.sqrt(3) / circles.radius, -0.98, 0.98))
    begin, goal = edge_lengths(circle_nodes(circles, guess)), np.asarray(geometry.top)
    upper = _along_edges(circles, guess, begin, np.broadcast_to(goal, begin.shape))
    if upper.reached.min(initial=1.0) < 1.0:
        raise AssemblyError("double octahedron, upper cell", float(np.max(np.abs(begin - goal))), "no upright assembly")
    return np.concatenate([lower, upper.phi.reshape(lower.shape)], axis=-1)


def forward(geometry: TwoCellGeometry, phi: ArrayLike, start: ArrayLike | None = None) -> Array:
    """Canonical forward solution: the state of phi_1 to phi_3, shape (..., 3), rad, on the mode of the start.

    The lower cell is in closed form, the upper one by its closure. The start is a state, or absent for `home`.

    Raises:
        AssemblyError: Impossible lengths, or a singularity of the upper cell lies between.

    Source: sections 3.5.1 and 3.2.
    """
    wanted = np.asarray(phi, float)
    begin = home(geometry, actuator_lengths(geometry, wanted)) if start is None else np.asarray(start, float)
    batch = np.broadcast_shapes(wanted.shape[:-1], begin.shape[:-1])
    state, reached = advance(geometry, np.broadcast_to(begin, (*batch, 6)), np.broadcast_to(wanted, (*batch, 3)))
    if reached.min(initial=1.0) < 1.0:
        upper = FollowedMode(state[..., 3:].reshape(-1, 3), reached.reshape(-1))
        lengths = (
            actuator_lengths(geometry, np.broadcast_to(item, (*batch, item.shape[-1]))) for item in (begin, wanted)
        )
        raise _ended_upper(geometry, upper, *(item.reshape(-1, 3) for item in lengths))
    return state


def advance(geometry: TwoCellGeometry, start: Array, phi: Array) -> tuple[Array, Array]:
    """As `forward`, without errors: states, and the fractions of the way covered, shape (...), below one where it ends."""
    begin = actuator_lengths(geometry, start).reshape(-1, 3)
    goal = actuator_lengths(geometry, phi).reshape(-1, 3)
    upper = _upper(geometry, begin, goal, start[..., 3:].reshape(-1, 3))
    state = np.concatenate([phi, upper.phi.reshape(phi.shape)], axis=-1)
    return state, upper.reached.reshape(phi.shape[:-1])


def forward_lengths(geometry: TwoCellGeometry, actuators: ArrayLike, start: ArrayLike | None = None) -> Array:
    """Conventional forward solution: the state of l1 to l3, shape (..., 3), m, by two closures, on the mode of the start.

    The start is a state, or absent for `home`.

    Raises:
        AssemblyError: Impossible lengths, or a singularity of either cell lies between; the detail has the smallest
            singular value and the member.

    Source: equations 3.28 to 3.46. Differs: undamped steps, each proved to stay on the mode.
    """
    wanted = np.asarray(actuators, float)
    begin = home(geometry, wanted) if start is None else np.asarray(start, float)
    batch = np.broadcast_shapes(wanted.shape[:-1], begin.shape[:-1])
    goal = np.broadcast_to(wanted, (*batch, 3)).reshape(-1, 3)
    state = np.broadcast_to(begin, (*batch, 6)).reshape(-1, 6)
    length = actuator_lengths(geometry, state)
    upper_circles(geometry, goal)  # refuses impossible lengths by name
    lower = _along_edges(geometry.circles, state[:, :3], length, goal)
    if lower.reached.min(initial=1.0) < 1.0:
        raise _ended_lower(geometry, lower, goal)
    upper = _upper(geometry, length, goal, state[:, 3:])
    if upper.reached.min(initial=1.0) < 1.0:
        raise _ended_upper(geometry, upper, length, goal)
    return np.concatenate([lower.phi, upper.phi], axis=-1).reshape(*batch, 6)


def advance_lengths(geometry: TwoCellGeometry, actuators: ArrayLike, start: ArrayLike) -> tuple[Array, Array]:
    """As `forward_lengths`, without errors: states, and the fractions of the way covered, shape (...), one where it led."""
    goal = np.asarray(actuators, float)
    state = np.broadcast_to(np.asarray(start, float), (*goal.shape[:-1], 6)).reshape(-1, 6)
    length = actuator_lengths(geometry, state)
    lower = _along_edges(geometry.circles, state[:, :3], length, goal.reshape(-1, 3))
    upper = _upper(geometry, length, actuator_lengths(geometry, lower.phi), state[:, 3:])
    found = np.concatenate([lower.phi, upper.phi], axis=-1).reshape(*goal.shape[:-1], 6)
    return found, np.minimum(lower.reached, upper.reached).reshape(goal.shape[:-1])


def _along_edges(circles: Circles, phi: Array, begin: Array, goal: Array) -> FollowedMode:
    """Follow a cell with fixed circles while its upper edges change, straight in their squares."""
    first = closure_coefficients(circles, begin).reshape(5, 3, -1)
    change = (begin**2 - goal**2).reshape(-1, 3).T
    return follow_squares(first, change, phi.reshape(-1, 3))


def _upper(geometry: TwoCellGeometry, begin: Array, goal: Array, phi: Array) -> FollowedMode:
    """Follow the upper cell while the actuators change, straight in their lengths."""
    return follow_sides(begin, goal, geometry.longerons[6:], geometry.top, phi)


def _ended_lower(geometry: TwoCellGeometry, result: FollowedMode, goal: Array) -> AssemblyError:
    """The error of the member of the batch whose lower cell got least far."""
    worst = int(np.argmin(result.reached))
    phi, t = result.phi[worst], result.reached[worst]
    value, row = worst_direction(angle_jacobian(geometry, phi))
    gap = np.abs(actuator_lengths(geometry, phi) - goal[worst])
    return _ended("lower cell", goal[worst], t, float(np.max(gap)), value, f"actuator l{row + 1}")


def _ended_upper(geometry: TwoCellGeometry, result: FollowedMode, begin: Array, goal: Array) -> AssemblyError:
    """The error of the member of the batch whose upper cell got least far."""
    worst = int(np.argmin(result.reached))
    phi, t = result.phi[worst], result.reached[worst]
    circles = upper_circles(geometry, begin[worst] + t * (goal[worst] - begin[worst]))
    top = circle_nodes(circles, phi)
    mid = triangle_nodes(begin[worst] + t * (goal[worst] - begin[worst]))
    _, J = leg_jacobian(mid[UPPER_LEGS[:, 0]], top[UPPER_LEGS[:, 1]], np.mean(top, axis=0))
    value, row = worst_direction(J, geometry.twist_units)
    there = circle_nodes(place_circles(triangle_nodes(goal[worst]), np.asarray(geometry.longerons[6:]), UPPER), phi)
    gap = float(np.max(np.abs(edge_lengths(there) - geometry.top)))
    return _ended("upper cell", goal[worst], t, gap, value, f"longeron L{row + 7}")


def _ended(cell: str, wanted: Array, t: float, gap: float, value: float, member: str) -> AssemblyError:
    detail = (
        f"the mode of the start ends {t:.4f} of the way to {np.array2string(wanted, precision=4)} m: "
        f"smallest singular value {value:.2g}, {member}"
    )
    return AssemblyError(f"double octahedron, {cell}", gap, detail)


def angle_jacobian(geometry: TwoCellGeometry, phi: ArrayLike) -> Array:
    """dl/dphi, shape (..., 3, 3), m/rad, at phi_1 to phi_3 or at a state: 3.14 with 3.33."""
    return closure.angle_jacobian(geometry.circles, np.asarray(phi, float)[..., :3])


def jacobian(geometry: TwoCellGeometry, state: ArrayLike) -> Array:
    """Motion of the top per unit rate of phi_1 to phi_3 at a state, shape (..., 6, 3), in closed form.

    The motion is the velocity of the origin of T, then the angular velocity of T, in frame B.

    Raises:
        SingularPoseError: The upper cell is singular.

    Source: section 3.5.4, step 5, for the general module.
    """
    angles = np.asarray(state, float)
    points = nodes(geometry, angles)
    velocity = mid_velocities(geometry, angles)[..., 3 + UPPER_LEGS[:, 0], :, :]
    J = upper_jacobian(points)
    inverse = invert_sound(J, geometry.twist_units, lambda _: "double octahedron, upper cell")
    # as much as a lower end moves along its longeron, the top moves it the other way
    return inverse @ np.einsum("...ik,...ikj->...ij", J[..., :3], velocity)


def upper_jacobian(points: Array) -> Array:
    """Derivative of L7 to L12 by the twist of the top, shape (..., 6, 6), of all moving nodes, shape (..., 9, 3), m."""
    origin = np.mean(points[..., 6:, :], axis=-2)
    return leg_jacobian(points[..., 3 + UPPER_LEGS[:, 0], :], points[..., 6 + UPPER_LEGS[:, 1], :], origin)[1]


def mid_velocities(geometry: TwoCellGeometry, phi: ArrayLike) -> Array:
    """Derivatives of n4, n5, n6, n4', n5', n6' in B by phi_1 to phi_3, (..., 6, 3, 3), m/rad, at those angles or a state."""
    angles = np.asarray(phi, float)
    points = mid_nodes(geometry, angles)
    tangent = circle_tangents(geometry.circles, angles[..., :3])
    moves = tangent[..., :, :, None] * np.eye(3)[:, None, :]
    first, second = points[..., 1, :] - points[..., 0, :], points[..., 2, :] - points[..., 0, :]
    cross = np.cross(first, second)
    size = np.linalg.norm(cross, axis=-1)[..., None, None]
    rate = np.cross(moves[..., 1, :, :] - moves[..., 0, :, :], second[..., None], axis=-2)
    rate = rate + np.cross(first[..., None], moves[..., 2, :, :] - moves[..., 0, :, :], axis=-2)
    w = cross[..., None] / size
    turn = (rate - w * np.sum(w * rate, axis=-2, keepdims=True)) / size
    return np.concatenate([moves, moves + geometry.joint_offset * turn[..., None, :, :]], axis=-3)


def singularity(geometry: TwoCellGeometry, state: ArrayLike) -> tuple[float, str]:
    """How near one state is to a singularity of either cell, and the member with most of the lost length change.

    Returns:
        The smaller of two pure numbers, and the member. The numbers are the smallest singular values of dl/dphi over
        the mean radius of the circles, and of dL/dtwist of the upper longerons in `twist_units`.
    """
    angles = np.asarray(state, float)
    value, row = worst_direction(angle_jacobian(geometry, angles), float(np.mean(geometry.circles.radius)))
    upper, leg = worst_direction(upper_jacobian(nodes(geometry, angles)), geometry.twist_units)
    return (value, f"actuator l{row + 1}") if value <= upper else (upper, f"longeron L{leg + 7}")
