"""Poses on a tour and beside it, for sizing without a simulation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics import Chain, swing
from vgtsim.planning.tour import Tour
from vgtsim.statics import NodeMotion

Array = NDArray[np.float64]

_AROUND = 24  # directions in which the arm reaches out
_HOOKS = 8  # local directions into which the free modules bend
_HOOK = 0.6  # bend of each, rad: what the strokes leave at the straight extension in any direction
_LEAN = np.pi / 4  # greatest bend of a module, rad
_DRAWN = 1500  # postures drawn at random; about 60 % of arm15's are inside the strokes


def sample_motion(chain: Chain, tour: Tour, spacing: float = 0.2) -> tuple[Array, NodeMotion]:
    """Nodes along a tour, goals included, shape (K, N, 3), m, in frame G, and their velocities and accelerations.

    The motion is by central differences over one step of the tour. `spacing` is the time between poses, s.
    """
    every, step = max(1, round(spacing / tour.timestep)), tour.timestep
    rows = []
    for leg in tour.legs:
        last = len(leg.lengths) - 1
        picked = np.append(np.arange(0, last, every), last)
        # a leg begins and ends at rest: the lengths before and after it are those at its ends
        rows.append(np.stack([leg.lengths[np.clip(picked + offset, 0, last)] for offset in (-1, 0, 1)], axis=1))
    lengths = np.concatenate(rows)
    nodes = chain.nodes(chain.inputs_from_lengths(lengths))
    before, now, after = np.moveaxis(nodes, 1, 0)
    return now, NodeMotion((after - before) / (2 * step), (after - 2 * now + before) / step**2)


def sample_postures(chain: Chain) -> Array:
    """Nodes of an arm of double octahedra in many postures, shape (K, N, 3), m, in frame G.

    Some postures reach out horizontally in all directions: the first three or more modules bend evenly to the
    horizontal, and the others stay straight, or bend together into every local direction, which twists the modules that
    carry them. In random postures each module bends in any direction by up to 45 degrees; the seed is fixed. Postures
    outside a stroke are left out.
    """
    active = len(chain.layout.names)
    shapes = []
    for bent in range(min(3, active), active + 1):
        plain = np.reshape(chain.straight, (active, 3)).copy()
        plain[:bent, 0] = np.sin(min(np.pi / 2 / bent, _LEAN) / 2)
        shapes.append(plain)
        for turn in 2 * np.pi / _HOOKS * np.arange(_HOOKS if bent < active else 0):
            hooked = np.array(plain)
            hooked[bent:, :2] = np.sin(_HOOK / 2) * np.array([np.cos(turn), np.sin(turn)])
            shapes.append(hooked)
    shaped = np.reshape(shapes, (len(shapes), -1))
    q = np.concatenate([swing(chain, shaped, angle) for angle in 2 * np.pi / _AROUND * np.arange(_AROUND)])
    rng = np.random.default_rng(0)
    bend, turn = rng.uniform((0.0, -np.pi), (_LEAN, np.pi), (_DRAWN, active, 2)).transpose(2, 0, 1)
    drawn = np.repeat(chain.straight[None], _DRAWN, axis=0)
    drawn[:, ::3], drawn[:, 1::3] = np.sin(bend / 2) * np.cos(turn), np.sin(bend / 2) * np.sin(turn)
    q = np.concatenate([q, drawn])
    length, (low, high) = chain.lengths(q), chain.stroke
    return chain.nodes(q[np.all((length >= low) & (length <= high), axis=1)])
