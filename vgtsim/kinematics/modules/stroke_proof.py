"""Proof that the strokes of a double octahedron are clear of singularities, all combinations of them.

In terms of the squared lengths s the closures are F(phi) - s, so the Jacobian J = dF/dphi of an assembly does not depend
on s, and the theorem of Newton and Kantorovich, see `mode_following`, holds for a whole box of s at once: with eta the
greatest |J^-1 (s0 - s)| in the box and beta K eta <= 1/2, a ball about the assembly at s0 holds exactly one assembly for
every s of the box, and J is regular there. The strokes are cut into such boxes. Each corner of a box is also reached along
a proved way, and must be in the ball: so neighbours, which share corners, have the same assemblies, and the strokes hold
one mode without a singularity. That the mid-plane keeps its side of the mid nodes' circles is looked at in all corners and
centres.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import SingularityError
from vgtsim.kinematics.mode_following import certify_box
from vgtsim.kinematics.modules.mid_plane import cell_closure
from vgtsim.kinematics.modules.sets import find_singular

if TYPE_CHECKING:
    from vgtsim.kinematics.modules.double_octahedral import DoubleOctahedra

Array = NDArray[np.float64]

_FIRST = 8  # boxes along each stroke that a proof begins with
_MOST_BOXES = 100_000  # of one module: more are only needed where a singularity is very near
_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))


def prove_strokes(own: DoubleOctahedra, low: Array, high: Array) -> int:
    """Prove that a double octahedron, a set of one, has no singularity within actuator lengths low to high, shape (3,), m.

    Returns:
        Number of boxes that the proof took.

    Raises:
        AssemblyError: Three actuators do not make a triangle.
        SingularityError: A singularity within the strokes, or so near that it cannot be told from one.
    """
    half = (high**2 - low**2) / (2 * _FIRST)
    centre = low**2 + half * np.array(list(product(2 * np.arange(_FIRST) + 1, repeat=3)))
    count, start = 0, None
    while len(centre):
        count += len(centre)
        x = own.solve(np.sqrt(centre)[:, None], start)
        phi = own.angles(x)[:, 0]
        closure = cell_closure(own.geometry, np.sqrt(centre)[:, None]).reshape(5, 3, -1)
        radius, quality = certify_box(closure, half, phi)
        apart = np.abs(_corner_angles(own, centre, half, low, x) - phi[:, None]).max(axis=(1, 2))
        left = ~((quality <= 0.5) & (apart <= radius))  # 1/2: Kantorovich's bound
        half, start = half / 2, np.repeat(x[left], 8, axis=0)
        centre = (centre[left][:, None] + _CORNERS * half).reshape(-1, 3)
        if count + len(centre) > _MOST_BOXES:
            raise _unproved(own, x[left])
    return count


def _corner_angles(own: DoubleOctahedra, centre: Array, half: Array, low: Array, x: Array) -> Array:
    """Angles at the corners of boxes, each found once and shared by the boxes around it, shape (N, 8, 3), rad."""
    lattice = np.rint((centre[:, None] + _CORNERS * half - low**2) / half).reshape(-1, 3)
    corner, first, index = np.unique(lattice, axis=0, return_index=True, return_inverse=True)
    found = own.solve(np.sqrt(low**2 + corner * half)[:, None], x[first // 8])
    return own.angles(found)[index.ravel(), 0].reshape(len(centre), 8, 3)


def _unproved(own: DoubleOctahedra, x: Array) -> SingularityError:
    """Names the place that no proof was found for and that is nearest to a singularity."""
    value, leg = find_singular(own, x)
    worst = int(np.argmin(value[:, 0]))
    member = f"{own.names[0]}/actuator/{leg[worst, 0] + 1}"
    return SingularityError(own.names[0], float(value[worst, 0]), member, 0.0, 1.0)
