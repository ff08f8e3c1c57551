"""Postures that carry most: redundancy used to unload the member that governs, in every cell of the capacity map."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np

from vgtsim.arrays import Array
from vgtsim.constants import PAYLOAD_RADIUS
from vgtsim.description import Payload
from vgtsim.kinematics import Chain
from vgtsim.positioning import Differences, GoalSpace, NewtonSettings, Position, Problem, inside, make_box, solve
from vgtsim.statics import CapacityMap, find_use, make_load_model, make_sections, map_capacity, smooth_peak

Spread = Callable[[Callable[[Array], Array], list[Array]], Iterable[Array]]

PIECE = 64  # postures unloaded together: enough to be quick, and few enough to share the work among cores

_STEPS = 60  # of one search: a bound on time, the promised fall ends most
_PROMISED = 1e-4  # fall of the utilisation that is not worth another step
_SPARE = 1e-3  # kept at the ends of strokes, m


def unload(chain: Chain, q: Array, payload: float, gravity: float, safety_factor: float) -> Array:
    """Move postures through their null space, the tool point held, to where the most used member is used least.

    Takes inputs inside the strokes, shape (K, n), a payload, kg, gravity, m/s², and Omega of AISC 360. Returns those
    that could be moved, shape (k, n).

    Raises:
        TrussError: The arm is a mechanism in one of the postures.

    Source: null-space optimisation (chapter 6) of a smooth stand-in for the greatest utilisation.
    """
    box = make_box(chain, _SPARE)
    start = q[inside(box, q)]
    if not len(start):
        return start
    model = make_load_model(chain, Payload(mass=payload, radius=PAYLOAD_RADIUS), gravity)
    sections = make_sections(chain)

    def used(postures: Array) -> Array:
        return smooth_peak(find_use(model, sections, chain.nodes(postures), safety_factor).worst)

    goal = GoalSpace((Position(chain.tool(start)[0], tolerance=1e-4),))
    problem = Problem(box=box, goal=goal, objective=Differences("utilisation", used))
    found = solve(problem, start, NewtonSettings(most=_STEPS, optimality=_PROMISED))
    return found.q[found.met]


def unload_map(
    chain: Chain, plane: CapacityMap, gravity: float, safety_factor: float, spread: Spread = map
) -> CapacityMap:
    """Map the postures of a map and the unloaded ones together, at its reference payload; see `unload`.

    `spread` may unload pieces of the postures beside one another: it is called as `map` is. The figures stay the same.

    Raises:
        TrussError: The arm is a mechanism in one of the postures.
    """
    settings = {"payload": plane.reference, "gravity": gravity, "safety_factor": safety_factor}
    pieces = [plane.q[i : i + PIECE] for i in range(0, len(plane.q), PIECE)]
    moved = spread(partial(unload, chain, **settings), pieces)
    return map_capacity(chain, np.concatenate([plane.q, *moved]), gravity, safety_factor, plane.reference)
