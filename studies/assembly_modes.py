"""All assembly modes of each kind of module and of chains of them (sections 3.4.1, 4.3.2).

A mode is one solution of the conventional forward problem: given lengths, the poses that they allow. The
tetrahedron has two, an octahedral cell sixteen (`closure_modes`). The two cells of a double octahedron share
only the actuators, whose lengths are given, so its assemblies are all pairs of a lower and an upper one: 256.
Differs: the dissertation counts 32 for the double octahedron (4.5). With the mirrored upper cell imposed it
has 16, one for each lower assembly; with the longerons alone given it has 256.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod

import numpy as np
from numpy.typing import ArrayLike, NDArray

from studies import tetrahedron as tetra
from studies.closure_modes import Modes, closure_modes
from studies.double_octahedron_goals import transform
from vgtsim.kinematics.closure import circle_nodes, closure_coefficients, triangle_frame, triangle_nodes
from vgtsim.kinematics.modules import octahedron as single
from vgtsim.kinematics.modules import two_cells as double

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Assemblies:
    """All assemblies of a module for given lengths.

    Attributes:
        count: Complex and real solutions together.
        R: R_BT of the real ones, shape (r, 3, 3).
        P: P_BT of the real ones, shape (r, 3), m.
        inputs: Canonical inputs of the real ones, shape (r, n): theta; phi_1 to phi_3; or phi_1 to phi_6.
        flexible: Whether there is a curve of solutions besides: a flexible octahedron.
    """

    count: int
    R: Array
    P: Array
    inputs: Array
    flexible: bool = False


def tetrahedron_assemblies(geometry: tetra.HingeModule, length: float) -> Assemblies:
    """Both assemblies of a tetrahedral module.

    Args:
        geometry: Fixed dimensions.
        length: l, m.

    Returns:
        The assemblies: tan(theta/2)² = l² / (4 h² - l²) has two roots, real below l = 2 h, imaginary above.
        At l = 0 and l = 2 h they are one double root.

    Source: equation 3.2.
    """
    longest = 2 * geometry.height
    theta = np.array([]) if length > longest or length < 0 else tetra.forward(geometry, np.array([length]))
    if theta.size and 0 < length < longest:
        theta = np.concatenate([theta, -theta])
    single_root = length in (0.0, longest)
    return Assemblies(1 if single_root else 2, *tetra.transform(geometry, theta), theta[:, None])


def octahedron_assemblies(geometry: single.OctahedronGeometry, longerons: ArrayLike) -> Assemblies:
    """All assemblies of a longeron-actuated octahedral module.

    Args:
        geometry: Fixed dimensions.
        longerons: l1 to l6, shape (6,), m.

    Returns:
        The assemblies.

    Raises:
        AssemblyError: A longeron pair does not assemble.
    """
    circles, C = single.closure(geometry, longerons)
    modes = closure_modes(C)
    R, P = triangle_frame(circle_nodes(circles, modes.phi))
    return Assemblies(len(modes.residual), R, P, modes.phi, modes.flexible)


def double_octahedron_cells(geometry: double.TwoCellGeometry, actuators: ArrayLike) -> tuple[Modes, Modes]:
    """All solutions of the two cells of a double octahedron.

    Args:
        geometry: Fixed dimensions.
        actuators: l1, l2, l3, shape (3,), m.

    Returns:
        Solutions of the lower and of the upper cell; every pair is an assembly.

    Raises:
        AssemblyError: Impossible lengths.
    """
    length = np.asarray(actuators, float)
    upper = closure_coefficients(double.upper_circles(geometry, length), geometry.top)
    return closure_modes(closure_coefficients(geometry.circles, length)), closure_modes(upper)


def double_octahedron_assemblies(geometry: double.TwoCellGeometry, actuators: ArrayLike) -> Assemblies:
    """All assemblies of a general double-octahedral module.

    Args:
        geometry: Fixed dimensions.
        actuators: l1, l2, l3, shape (3,), m.

    Returns:
        The assemblies.

    Raises:
        AssemblyError: Impossible lengths.
    """
    lower, upper = double_octahedron_cells(geometry, actuators)
    first, second = np.meshgrid(np.arange(len(lower.phi)), np.arange(len(upper.phi)), indexing="ij")
    state = np.concatenate([lower.phi[first.ravel()], upper.phi[second.ravel()]], axis=-1)
    count = len(lower.residual) * len(upper.residual)
    return Assemblies(count, *transform(geometry, state), state, lower.flexible or upper.flexible)


def mirrored_assemblies(geometry: double.TwoCellGeometry, actuators: ArrayLike) -> Assemblies:
    """Assemblies of a symmetric double octahedron whose upper cell mirrors the lower (section 3.5.3).

    Args:
        geometry: Fixed dimensions of a symmetric module; its upper longerons and top triangle are not looked
            at.
        actuators: l1, l2, l3, shape (3,), m.

    Returns:
        The assemblies; inputs are phi_1 to phi_3.

    Source: equations 3.52 to 3.54.
    """
    modes = closure_modes(closure_coefficients(geometry.circles, np.asarray(actuators, float)))
    R, P = triangle_frame(circle_nodes(geometry.circles, modes.phi))
    U = R[..., :, 2]
    d = np.sum(U * P, axis=-1)
    base = triangle_nodes(geometry.base)
    reach = 2 * (d[:, None] - U @ base.T) + geometry.joint_offset
    top = base + reach[..., None] * U[:, None, :]
    return Assemblies(len(modes.residual), *triangle_frame(top), modes.phi, modes.flexible)


def count_assemblies(modules: Sequence[int]) -> int:
    """Assemblies of a chain of active modules, given those of each.

    Args:
        modules: N_i, the number of solutions of each active module.

    Returns:
        Their product.

    Source: equation 4.4.
    """
    return prod(modules)
