"""Search of a module's strokes for singularities, where no proof is known.

An octahedron has up to six actuators, and the upper cell of a general double octahedron has other circles for all other
lengths. Here ways are followed from the straight pose to every corner and to seeded points all over the surface of the
strokes, then ever closer to where the smallest singular value is least.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics.modules.sets import ModuleSet

Array = NDArray[np.float64]

_SURFACE = 512  # seeded points on the surface of the strokes
_CANDIDATES, _TRIES, _ROUNDS = 24, 8, 12  # of the search for the least singular value
_SHRINK = 0.6  # of the search's radius from round to round


def search_strokes(own: ModuleSet, low: Array, high: Array, seed: int = 0) -> float:
    """Search the strokes of one module, a set of one, for a singularity; k actuators of lengths low to high, shape (k,), m.

    Returns:
        The least of the smallest singular values that were met, a pure number.

    Raises:
        AssemblyError: Two longerons do not meet over their edge, or three actuators make no triangle within the strokes.
        SingularityError: One was met on the way to somewhere within the strokes.
    """
    rng, size = np.random.default_rng(seed), len(low)
    legs = own.straight_legs[0]

    def least(points: Array) -> Array:
        """Smallest singular values at points of the unit box, shape (N,)."""
        lengths = np.broadcast_to(legs, (len(points), *legs.shape)).copy()
        lengths[:, 0, own.actuated[0]] = (low + high) / 2 + points * (high - low) / 2
        return own.find_least(own.solve(lengths, own.straight))[:, 0]

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
