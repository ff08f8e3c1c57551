"""Octahedra by the dissertation: its damped iteration as printed, and rates by longerons of which some are static."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from studies.closure_modes import closure_values, solve_cyclic
from vgtsim.errors import AssemblyError
from vgtsim.kinematics.closure import circle_angles, closure_slopes, edge_jacobian
from vgtsim.kinematics.conditioning import invert_sound
from vgtsim.kinematics.modules.octahedron import OctahedronGeometry, closure, length_jacobian, lengths, top_nodes

Array = NDArray[np.float64]

_KEPT = 1e-9  # m: rounding of a pose that was meant to lie in the module's subspace


def damped_newton(C: ArrayLike, edges: ArrayLike, start: ArrayLike, damping: float, count: int) -> tuple[Array, Array]:
    """The dissertation's own iteration, as printed, with its history.

    Args:
        C: Closure, shape (5, 3, ...), m².
        edges: Lengths between the upper nodes, shape (..., 3), m.
        start: Angles to start from, shape (..., 3), rad.
        damping: sigma.
        count: Number of iterations.

    Returns:
        Angles after the last iteration, shape (..., 3), rad, and the greatest |D - L| before the first
        iteration and after each, shape (count + 1, ...), m.

    Source: equations 3.12 to 3.14 and the update after them. It may leave the mode of its start; `follow_mode`
    does not.
    """
    C, angles = np.asarray(C, float), np.asarray(start, float)
    phi, edge = np.moveaxis(angles, -1, 0), np.moveaxis(np.broadcast_to(edges, angles.shape), -1, 0)
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
    result[..., find_actuated(geometry)] = moving
    return result


def find_actuated(geometry: OctahedronGeometry) -> NDArray[np.intp]:
    """Indices of the actuated longerons, shape (6 - k,)."""
    return np.array([i for i, length in enumerate(geometry.static) if length is None], dtype=np.intp)


def inverse(geometry: OctahedronGeometry, R: ArrayLike, P: ArrayLike, tolerance: float = _KEPT) -> Array:
    """Inverse solution (section 3.4.2): l1 to l6, shape (..., 6), m, of a pose that the module can take.

    Raises:
        AssemblyError: A static longeron, which is named, would need another length by more than the tolerance, m: the
            pose is outside the (6 - k)-dimensional subspace of the module. The residual is the greatest such error.
    """
    result = lengths(geometry, R, P)
    fixed = np.array([np.nan if item is None else item for item in geometry.static])
    error = np.where(np.isnan(fixed), 0.0, np.abs(result - fixed))
    if np.any(error > tolerance):
        worst = np.unravel_index(int(np.argmax(error)), error.shape)
        needs = f"static longeron l{int(worst[-1]) + 1} would be {result[worst]:.6g} m"
        detail = f"pose outside the {find_actuated(geometry).size}-dimensional subspace: {needs}"
        raise AssemblyError("octahedron", float(error[worst]), detail)
    return result


def angles(geometry: OctahedronGeometry, R: ArrayLike, P: ArrayLike) -> Array:
    """Angles phi_1 to phi_3 of the equivalent mechanism of a pose, shape (..., 3), rad."""
    return circle_angles(closure(geometry, lengths(geometry, R, P))[0], top_nodes(geometry, R, P))


def angle_jacobian(geometry: OctahedronGeometry, R: ArrayLike, P: ArrayLike) -> Array:
    """The matrix of the forward iteration at a pose, dD/dphi, shape (..., 3, 3), m/rad: equation 3.14."""
    C = closure(geometry, lengths(geometry, R, P))[1]
    return edge_jacobian(C, geometry.top, angles(geometry, R, P))


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
    return invert_sound(J, geometry.twist_units, lambda _: "octahedron")[..., find_actuated(geometry)]
