"""What a chain asks of all its active modules of one kind, which are solved together.

A set has M modules with the same number of inputs (canonical, see the module's own file) and of legs (the members whose
lengths can change). Inputs are x, shape (..., M, inputs); leading dimensions are batches. All methods are in the frames
B of the modules. The sets are `DoubleOctahedra`, `GeneralDoubleOctahedra`, `Octahedra` and
`Tetrahedra`.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics.mode_following import worst_row

Array = NDArray[np.float64]


class ModuleSet(Protocol):
    """What a chain asks of a set.

    Attributes:
        inputs: Number of canonical inputs of a module.
    """

    inputs: int

    @property
    def inner_count(self) -> int:
        """Number of nodes of a module that are on neither face."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """Of the modules."""
        ...

    @property
    def actuated(self) -> NDArray[np.bool_]:
        """Which legs are actuators, shape (M, legs)."""
        ...

    def transform(self, x: Array) -> tuple[Array, Array]:
        """R_BT, shape (..., M, 3, 3), and P_BT, shape (..., M, 3), m."""
        ...

    def twist(self, x: Array) -> tuple[Array, Array]:
        """Angular velocity of T and velocity of its origin per unit rate, each shape (..., M, 3, inputs)."""
        ...

    def inner(self, x: Array) -> Array:
        """Inner nodes, shape (..., M, inner_count, 3), m."""
        ...

    def inner_derivative(self, x: Array) -> Array:
        """Their derivatives, shape (..., M, inner_count, 3, inputs)."""
        ...

    def length_jacobian(self, x: Array) -> tuple[Array, Array]:
        """Leg lengths, shape (..., M, legs), m, and dl/dx, shape (..., M, legs, inputs)."""
        ...

    def legs(self, x: Array) -> tuple[Array, Array]:
        """As `length_jacobian`, for any x: static legs too have the lengths of the pose."""
        ...

    def attempt(self, lengths: Array, start: Array | None) -> tuple[Array, Array]:
        """Follow leg lengths, shape (..., M, legs), from a start, shape (..., M, inputs), on its assembly mode.

        Without a start, from the module's own straight pose. Returns inputs, and the fraction of the way covered, shape
        (..., M): one where the lengths were reached.
        """
        ...

    def solve(self, lengths: Array, start: Array | None) -> Array:
        """As `attempt`, but all lengths must be reached.

        Raises:
            AssemblyError: Lengths that no pose can have; the module is named.
            SingularityError: A singularity lies between.
        """
        ...

    def conditioned(self, x: Array) -> Array:
        """Derivative of the legs' lengths in units that make it a pure number, shape (..., M, legs, legs)."""
        ...


def all_legs(names: tuple[str, ...], legs: int) -> NDArray[np.bool_]:
    """`actuated` of a set without static legs, shape (M, legs)."""
    return np.ones((len(names), legs), dtype=bool)


def no_inner(x: Array) -> tuple[Array, Array]:
    """`inner` and `inner_derivative` of a set whose nodes are all on its faces, for x of shape (..., M, inputs)."""
    return np.empty((*x.shape[:-1], 0, 3)), np.empty((*x.shape[:-1], 0, 3, x.shape[-1]))


def find_short(reached: Array) -> tuple[int, ...] | None:
    """Which member of a batch got least far on its way, as an index; None when all arrived.

    Args:
        reached: Fractions of the way covered, shape (..., M).

    Returns:
        Index, its last entry the module.
    """
    if reached.min(initial=1.0) == 1.0:
        return None
    return tuple(int(i) for i in np.unravel_index(int(np.argmin(reached)), reached.shape))


def find_singular(module_set: ModuleSet, x: Array) -> tuple[Array, NDArray[np.intp]]:
    """Smallest singular value of each module, a pure number, and the leg worst of it.

    Args:
        module_set: The set.
        x: Shape (..., M, inputs).

    Returns:
        Shapes (..., M).
    """
    left, value, _ = np.linalg.svd(module_set.conditioned(x))
    return value[..., -1], worst_row(left, value)
