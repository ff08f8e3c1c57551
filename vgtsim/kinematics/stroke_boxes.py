"""Whether the strokes of a module's actuators, all combinations of them, are clear of singularities.

A tetrahedral module has one actuator and its flat pose ends its range: the description refuses strokes that cross it.

Of a double octahedron, with three actuators, it is proved. In terms of the squared lengths s the closures are F(phi) - s,
so the Jacobian J = dF/dphi of an assembly does not depend on s, and the theorem of Newton and Kantorovich, see
`mode_following`, holds for a whole box of s at once: with eta the greatest |J^-1 (s0 - s)| in the box and beta K eta <=
1/2, a ball about the assembly at s0 holds exactly one assembly for every s of the box, and J is regular there. The strokes
are cut into such boxes. Each corner of a box is also come to along a proved way, and must be in the
ball: so neighbours, which share corners, have the same assemblies, and the strokes one mode without a singularity. That the
mid-plane keeps its side of the mid nodes' circles is looked at in all corners and centres.

Of an octahedron, with up to six actuators, and of a general double octahedron, whose upper cell has other circles for
all other lengths, it is searched for: ways from the straight pose to every corner and to seeded points all over the
surface of the strokes, then ever closer to where the smallest singular value, of either cell, is least.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import SingularityError
from vgtsim.kinematics import double_octahedron as double
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.double_octahedra import DoubleOctahedra, cell_closure
from vgtsim.kinematics.general_double_octahedra import GeneralDoubleOctahedra
from vgtsim.kinematics.mode_following import certify_box
from vgtsim.kinematics.module_sets import find_singular
from vgtsim.kinematics.octahedra import Octahedra

Array = NDArray[np.float64]

_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
_FIRST = 8  # boxes along each stroke that a proof begins with
_MOST_BOXES = 100_000  # of one module: more are only needed where a singularity is very near
_SURFACE = 512  # seeded points on the surface of the strokes of a module that is searched
_CANDIDATES, _TRIES, _ROUNDS = 24, 8, 12  # of the search for the least singular value
_SHRINK = 0.6  # of the search's radius from round to round


def check_strokes(chain: Chain) -> None:
    """Refuse an arm with a module whose strokes hold a singularity.

    Args:
        chain: The arm.

    Raises:
        AssemblyError: Lengths within the strokes do not make the module; it is named.
        SingularityError: The module, the smallest singular value where the way ends, and the member.
    """
    low, high = chain.stroke
    done: set[tuple[object, ...]] = set()
    for place in chain.layout.places:
        modules = place.modules
        for m, name in enumerate(modules.names):
            own = place.lengths[m][modules.actuated[m]]
            geometry = name
            if isinstance(modules, DoubleOctahedra):
                geometry = modules.one(m)
            elif isinstance(modules, Octahedra | GeneralDoubleOctahedra):
                geometry = modules.geometries[m]
            alike = (geometry, *low[own], *high[own], *place.straight[m])
            if alike in done:
                continue
            done.add(alike)
            if isinstance(modules, DoubleOctahedra):
                prove_double_octahedron(name, modules.one(m), low[own], high[own])
            elif isinstance(modules, Octahedra):
                single = Octahedra((name,), (modules.geometries[m],))
                search_strokes(single, place.straight[m], low[own], high[own])
            elif isinstance(modules, GeneralDoubleOctahedra):
                single = GeneralDoubleOctahedra((name,), (modules.geometries[m],), modules.begins[m : m + 1])
                search_strokes(single, place.straight[m], low[own], high[own])


def prove_double_octahedron(name: str, geometry: double.Geometry, low: Array, high: Array) -> int:
    """Prove that the strokes of a double octahedron are clear of singularities.

    Args:
        name: Of the module.
        geometry: Its dimensions.
        low: Least actuator lengths, shape (3,), m.
        high: Greatest, shape (3,), m.

    Returns:
        Number of boxes that the proof took.

    Raises:
        AssemblyError: Three actuators do not make a triangle.
        SingularityError: A singularity within the strokes, or so near that it cannot be told from one.
    """
    own = DoubleOctahedra((name,), double.Geometry(*(np.array([x]) for x in _dimensions(geometry))))
    half = (high**2 - low**2) / (2 * _FIRST)
    centre = low**2 + half * np.array(list(product(2 * np.arange(_FIRST) + 1, repeat=3)))
    count, start = 0, None
    while len(centre):
        count += len(centre)
        x = own.solve(np.sqrt(centre)[:, None], start)
        phi = own.angles(x)[:, 0]
        radius, quality = certify_box(cell_closure(geometry, np.sqrt(centre)), half, phi)
        apart = np.abs(_corner_angles(own, centre, half, low, x) - phi[:, None]).max(axis=(1, 2))
        left = ~((quality <= 0.5) & (apart <= radius))
        half, start = half / 2, np.repeat(x[left], 8, axis=0)
        centre = (centre[left][:, None] + _CORNERS * half).reshape(-1, 3)
        if count + len(centre) > _MOST_BOXES:
            raise _unproved(own, x[left])
    return count


def _dimensions(geometry: double.Geometry) -> tuple[float, float, float]:
    return float(geometry.face_side), float(geometry.longeron), float(geometry.joint_offset)


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


def search_strokes(
    own: Octahedra | GeneralDoubleOctahedra, straight: Array, low: Array, high: Array, seed: int = 0
) -> float:
    """Search the strokes of an octahedral or general double-octahedral module for a singularity.

    Args:
        own: A set of this module alone.
        straight: Inputs of its straight pose, shape (inputs,).
        low: Least lengths of its k actuators, shape (k,), m.
        high: Greatest, shape (k,), m.
        seed: Of the random numbers.

    Returns:
        The least of the smallest singular values that were met, a pure number.

    Raises:
        AssemblyError: Two longerons do not meet over their edge, or three actuators make no triangle, within their strokes.
        SingularityError: One was met on the way to somewhere within the strokes.
    """
    rng, size = np.random.default_rng(seed), len(low)
    legs = own.length_jacobian(straight[None])[0]

    def least(points: Array) -> Array:
        """Smallest singular values at points of the unit box, shape (N,)."""
        lengths = np.broadcast_to(legs, (len(points), *legs.shape)).copy()
        lengths[:, 0, own.actuated[0]] = (low + high) / 2 + points * (high - low) / 2
        x = own.solve(lengths, straight[None])
        if isinstance(own, GeneralDoubleOctahedra):
            return own.least_singular(x)[:, 0]
        return find_singular(own, x)[0][:, 0]

    surface = rng.uniform(-1, 1, (_SURFACE, size))
    surface /= np.abs(surface).max(axis=1, keepdims=True)
    points = np.concatenate([np.array(list(product((-1.0, 1.0), repeat=size))), surface])
    value = least(points)
    best = np.argsort(value)[:_CANDIDATES]
    points, value = points[best], value[best]
    for radius in _SHRINK ** np.arange(_ROUNDS):
        tried = points[:, None] + radius * rng.uniform(-1, 1, (len(points), _TRIES, size))
        tried = np.clip(tried, -1, 1)
        found = least(tried.reshape(-1, size)).reshape(len(points), _TRIES)
        pick = np.argmin(found, axis=1)
        better = found[np.arange(len(points)), pick] < value
        points[better] = tried[np.arange(len(points)), pick][better]
        value = np.minimum(value, found.min(axis=1))
    return float(value.min())
