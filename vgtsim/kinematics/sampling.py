"""Seeded random configurations of a chain, and how near each is to a singularity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import SingularityError
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.modules import find_singular

Array = NDArray[np.float64]


def sample_inputs(chain: Chain, count: int, seed: int, part: float = 1.0) -> Array:
    """Configurations q, shape (count, n), with lengths evenly spread over a part of the strokes about their middle.

    Each is on the assembly mode of the straight pose. Lengths that only a way through a singularity reaches are drawn
    again.

    Raises:
        SingularityError: Hardly any lengths can be reached.
    """
    rng = np.random.default_rng(seed)
    least, greatest = chain.stroke
    middle, half = (least + greatest) / 2, part * (greatest - least) / 2
    x = np.empty((count, chain.layout.inputs))
    for place in chain.layout.places:
        modules, straight = place.modules, place.modules.straight_legs[0]
        for m in range(len(modules.names)):
            own = place.lengths[m][modules.actuated[m]]
            rows, tries = np.empty((0, modules.inputs)), 0
            while len(rows) < count:
                size = 2 * (count - len(rows)) + 8
                legs = np.broadcast_to(straight, (size, *straight.shape)).copy()
                legs[:, m, modules.actuated[m]] = middle[own] + half[own] * rng.uniform(-1, 1, (size, len(own)))
                found, reached = modules.attempt(legs)
                rows = np.concatenate([rows, found[reached[:, m] == 1.0, m]])
                tries += 1
                if tries > 100:
                    raise SingularityError(modules.names[m], 0.0, chain.truss.member_names[place.moving[0]], 0.0, 0.0)
            x[:, place.columns[m]] = rows[:count]
    return x


def within_strokes(chain: Chain, q: Array) -> NDArray[np.bool_]:
    """Which configurations of shape (N, n) assemble with every actuator in its stroke and every static leg at its length."""
    state, (low, high) = chain.state(q), chain.stroke
    kept = [part.kept.all(axis=1) for part in state.parts]
    return state.assembles & np.all(kept, axis=0) & np.all((state.lengths >= low) & (state.lengths <= high), axis=1)


def singular_values(chain: Chain, q: Array) -> tuple[Array, Array]:
    """Smallest singular value of each module, a pure number, and the leg worst of it, shapes (N, A), at q of shape (N, n)."""
    value, worst = np.empty((2, len(q), len(chain.layout.names)))
    for place in chain.layout.places:
        value[:, place.active], worst[:, place.active] = find_singular(place.modules, place.take(q))
    return value, worst
