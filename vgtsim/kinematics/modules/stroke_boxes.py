"""Whether the strokes of every module's actuators, all combinations of them, are clear of singularities: by proof or search.

An octahedron has up to six actuators, and the upper cell of a general double octahedron has other circles for all other
lengths: no proof is known. Ways are followed from the straight pose to every corner and to seeded points all over the surface
of the strokes, then ever closer to where the smallest singular value is least.

The strokes of a symmetric double octahedron are proved. In terms of the squared lengths s the closures are F(phi) - s, so the
Jacobian J = dF/dphi of an assembly does not depend on s, and the theorem of Newton and Kantorovich, see `mode_following`,
holds for a whole box of s at once: with eta the greatest |J^-1 (s0 - s)| in the box and beta K eta <= 1/2, a ball about the
assembly at s0 holds exactly one assembly for every s of the box, and J is regular there. The strokes are cut into such boxes.
Each corner of a box is also reached along a proved way, and must be in the ball: so neighbours, which share corners, have the
same assemblies, and the strokes hold one mode without a singularity. That the mid-plane keeps its side of the mid nodes'
circles is looked at in all corners and centres.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from vgtsim.arrays import Array
from vgtsim.errors import AssemblyError, SingularityError, UnusualWarning
from vgtsim.kinematics.closure import closure_coefficients
from vgtsim.kinematics.mode_following import certify_box
from vgtsim.kinematics.modules.sets import ModuleSet, find_singular

if TYPE_CHECKING:
    from vgtsim.kinematics.chain import Chain
    from vgtsim.kinematics.modules.double_octahedral import DoubleOctahedra

_SURFACE, _SEED = 512, 0  # seeded points on the surface of the strokes
_CANDIDATES, _TRIES, _ROUNDS = 24, 8, 12  # of the search for the least singular value
_SHRINK = 0.6  # of the search's radius from round to round
_FIRST = 8  # boxes along each stroke that a proof begins with
_MOST_BOXES = 100_000  # of one module: more are only needed where a singularity is very near
_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))


def search_strokes(own: ModuleSet, low: Array, high: Array) -> float:
    """Search the strokes of one module, a set of one, for a singularity; k actuators of lengths low to high, shape (k,), m.

    Returns:
        The least of the smallest singular values that were met, a pure number.

    Raises:
        AssemblyError: Two longerons do not meet over their edge, or three actuators make no triangle within the strokes.
        SingularityError: One was met on the way to somewhere within the strokes.
    """
    rng, size = np.random.default_rng(_SEED), len(low)
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
        closure = closure_coefficients(own.geometry.circles, np.sqrt(centre)[:, None]).reshape(5, 3, -1)
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
    # corners, whole numbers from 0, as one number each, in the same order: sorted six times quicker than as rows
    size = lattice.max() + 1
    _, first, index = np.unique((lattice @ [size**2, size, 1.0]), return_index=True, return_inverse=True)
    found = own.solve(np.sqrt(low**2 + lattice[first] * half)[:, None], x[first // 8])
    return own.angles(found)[index.ravel(), 0].reshape(len(centre), 8, 3)


def _unproved(own: DoubleOctahedra, x: Array) -> SingularityError:
    """Names the place that no proof was found for and that is nearest to a singularity."""
    value, leg = find_singular(own, x)
    worst = int(np.argmin(value[:, 0]))
    member = f"{own.names[0]}/actuator/{leg[worst, 0] + 1}"
    return SingularityError(own.names[0], float(value[worst, 0]), member, 0.0, 1.0)


def check_strokes(chain: Chain) -> None:
    """Refuse an arm with a module whose strokes hold a singularity; each kind has its proof or its search.

    A module that says why its strokes are used `unproved` is warned of.

    Raises:
        AssemblyError: Lengths within the strokes do not make the module; it is named, with its keys.
        SingularityError: The module, the smallest singular value where the way ends, and the member.
    """
    low, high = chain.stroke
    done: set[tuple[object, ...]] = set()
    for place in chain.layout.places:
        modules = place.modules
        for m in range(len(modules.names)):
            own = place.lengths[m][modules.actuated[m]]
            alike = (type(modules), modules.dimensions(m), *low[own], *high[own], *modules.straight[m])
            if alike not in done:
                done.add(alike)
                _check(chain, _Strokes(alike, modules.one(m), low[own], high[own]))


@dataclass(frozen=True)
class _Strokes:
    """Strokes of one module, a set of one: what is true of them is true of all with the same figures."""

    figures: tuple[object, ...]
    own: ModuleSet = field(compare=False)
    low: Array = field(compare=False)
    high: Array = field(compare=False)


@lru_cache(maxsize=64)
def _require_sound(strokes: _Strokes) -> None:
    """Refuse strokes that hold a singularity; arms of one program, as those of a study, share what was proved before."""
    strokes.own.check_strokes(strokes.low, strokes.high)


def _check(chain: Chain, asked: _Strokes) -> None:
    own, low, high = asked.own, asked.low, asked.high
    module = next(module for module in chain.manipulator.active if module.name == own.names[0])
    try:
        _require_sound(asked)
    except AssemblyError as error:
        strokes = ", ".join(
            f"{a:.4g} to {b:.4g} m" for a, b in sorted(set(zip(low.tolist(), high.tolist(), strict=True)))
        )
        index = chain.manipulator.modules.index(module)
        if module.unproved:
            message = f"modules.{index}.unproved: strokes of {strokes} are accepted though {error}"
            warnings.warn(message, UnusualWarning, stacklevel=3)
            return
        narrow = (
            "narrow the cylinder's retracted length and stroke, or say in the module's key `unproved` why it may be"
        )
        error.args = (f"modules.{index}, cylinder strokes of {strokes}: {error}; {narrow}",)
        raise
