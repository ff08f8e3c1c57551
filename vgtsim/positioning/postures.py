"""A table of postures: configurations all over the strokes of an arm, and where they put the tool."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import AssemblyError
from vgtsim.kinematics import Chain, bend_all, sample_inputs
from vgtsim.positioning.strokes import StrokeBox, bring_inside, inside

Array = NDArray[np.float64]

_SEED = 1993  # any number: the same table for the same arm and box
_COUNT = 600  # postures of a table: enough that one comes near most goals
_MOST_BEND = np.radians(40.0)  # of a module in the postures
_PART = 0.88  # of the strokes that postures use: ends are left for what a goal asks


@dataclass(frozen=True)
class PostureTable:
    """N inputs inside the strokes, shape (N, n), with tool positions, m, and directions in B_1, shape (N, 3)."""

    q: Array
    position: Array
    direction: Array


def make_postures(box: StrokeBox, count: int = _COUNT) -> PostureTable:
    """Draw a number of postures: one half with every actuator anywhere in its stroke, one half bent smoothly."""
    rng, chain = np.random.default_rng(_SEED), box.chain
    if chain.leans:
        q = _double_octahedral(box, count, rng)
    elif len(box.chain.layout.static):  # a bend would not leave static legs their lengths
        q = sample_inputs(chain, count, _SEED, _PART)
    else:
        q = np.concatenate([_bent(box, count // 2, rng), sample_inputs(chain, count - count // 2, _SEED, _PART)])
    position, direction = chain.tool(q)
    R = chain.mount[:3, :3]
    return PostureTable(q, (position - chain.mount[:3, 3]) @ R, direction @ R)


def _double_octahedral(box: StrokeBox, count: int, rng: np.random.Generator) -> Array:
    """Postures of an arm of double octahedra, by lengths: three equal ones lean as the bend says."""
    modules, low = len(box.chain.layout.names), (1 - _PART) / 2
    part = low + _PART * rng.random((count, modules, 3))
    curve = _curves(modules, count // 2, rng)
    wave = 2 * np.pi / 3 * np.arange(3)
    lean = 0.45 * (curve[..., :1] * np.cos(wave) + curve[..., 1:] * np.sin(wave))
    part[: count // 2] = np.clip(0.5 * rng.uniform(0.4, 1.4, (count // 2, 1, 1)) + lean, low, 1 - low)
    return _assemble(box.chain, box.least + part.reshape(count, -1) * (box.greatest - box.least))


def _curves(count: int, number: int, rng: np.random.Generator) -> Array:
    """Bends along arms of `count` modules in two planes, between -1 and 1, shape (number, count, 2)."""
    stations = np.linspace(0, 1, count)
    bend = rng.uniform(-1, 1, (number, 3, 2))
    curve = np.stack([np.interp(stations, [0, 0.5, 1], row) for pair in bend for row in pair.T])
    return curve.reshape(number, 2, -1).swapaxes(1, 2)


def _bent(box: StrokeBox, count: int, rng: np.random.Generator) -> Array:
    """Symmetric bends of all modules, those that leave the strokes drawn towards their middle, shape (count, n)."""
    curve = _curves(len(box.chain.layout.names), count, rng)
    angle = _MOST_BEND * np.linalg.norm(curve, axis=-1)
    q = bend_all(box.chain, angle, np.arctan2(curve[..., 1], curve[..., 0]))
    good = inside(box, q)
    q[~good] = bring_inside(box, q[~good])
    return q[inside(box, q)]


def _assemble(chain: Chain, lengths: Array) -> Array:
    """Inputs of those lengths, shape (N, n), that assemble; a batch that fails is halved."""
    try:
        return chain.inputs_from_lengths(lengths)
    except AssemblyError:
        if len(lengths) == 1:
            return np.empty((0, chain.layout.inputs))
        half = len(lengths) // 2
        return np.concatenate([_assemble(chain, lengths[:half]), _assemble(chain, lengths[half:])])
