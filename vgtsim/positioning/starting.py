"""A posture to begin from: clear of everything, or with the tool at a place.

The search is the same every time: bends in vertical planes all round the mast first, then the table of postures swung round
the mast. Of the postures that are clear it takes one with room to move, and of those the one with its tool nearest to a point.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import Bend, StartPosture
from vgtsim.errors import AssemblyError, DescriptionError
from vgtsim.kinematics import Subspace, bend_all, bend_start, can_swing, swing
from vgtsim.positioning.goals import tool_goal
from vgtsim.positioning.newton import NewtonSettings
from vgtsim.positioning.objectives import ClearanceHinges, StrokeBarrier, WeightedSum, goal_plane
from vgtsim.positioning.problem import Keep, Problem
from vgtsim.positioning.reduction import Reduction
from vgtsim.positioning.restarts import make_postures, pattern_bends
from vgtsim.positioning.solver import solve_by_method
from vgtsim.positioning.strokes import StrokeBox, bring_inside, inside

_AROUND = 24  # azimuths that bends are tried in: every 15 degrees
_TURNS = 8  # azimuths that a posture of the table is tried in, one more group each
_ROOM = 0.25  # m beyond the wanted clearance from which more is no better
_GRAIN = 1e-3  # m: clearances are compared to this, so that rounding does not choose
_JUDGED = 12  # postures of a group that are judged with their sag, the best first
_OFF = 1e-4  # m from the ends of the strokes that a plan may use, at which a stowed arm stands at the nearest
_FROM = "one for each actuator from the mast to the tool"
_WEIGHTS = (1.0, 0.01, 10.0)  # of clearance, strokes and bends in one plane: those of a scene that names no objective


def find_start(
    box: StrokeBox, keep: Keep, given: tuple[Bend, ...] | StartPosture | str, reduction: Reduction | None = None
) -> Array:
    """Inputs, shape (n,), of the posture that a scene gives; only that of a tool pose is looked for.

    Raises:
        DescriptionError: There are too many lengths or inputs, or too few, or the lengths do not assemble.
        ReachError: No posture has the tool there.
    """
    chain = box.chain
    if isinstance(given, tuple):
        return bend_start(chain, given)
    if isinstance(given, str):  # stowed
        lengths = np.clip(chain.lengths(chain.stowed), box.least + _OFF, box.greatest - _OFF)
        return chain.inputs_from_lengths(lengths)
    if given.position is not None:
        goal = tool_goal(given.position, np.array(given.direction))
        around = keep.surroundings.unloaded
        hinges = ClearanceHinges(around, keep.clearance, payload=False)
        parts = zip(_WEIGHTS, (hinges, StrokeBarrier(), goal_plane(chain, given.position)), strict=True)
        problem = Problem(
            box=box,
            goal=goal,
            objective=WeightedSum(tuple(parts)),
            reduction=reduction,
            keep=Keep(around, keep.clearance),
        )
        first = bring_inside(box, chain.straight)
        return np.array(solve_by_method("start", problem, first, NewtonSettings()).q)
    if given.inputs is not None:
        _require_count("inputs", len(given.inputs), chain.layout.inputs)
        return np.array(given.inputs)
    lengths = np.array(given.lengths)
    _require_count("lengths", len(lengths), chain.layout.actuators)
    try:
        return chain.inputs_from_lengths(lengths)
    except AssemblyError as error:
        raise DescriptionError(None, "motion.start.lengths", f"lengths that do not fit: {error}", _FROM) from None


def _require_count(key: str, found: int, wanted: int) -> None:
    if found != wanted:
        raise DescriptionError(None, f"motion.start.{key}", f"{found} figures", f"{wanted} figures, {_FROM}")


def search_start(box: StrokeBox, keep: Keep, near: Array, space: Subspace | None = None) -> tuple[Array, int]:
    """Find inputs, shape (n,), that are clear of everything, or those that come nearest to it, and the number tried.

    They are in a subspace; absent, in that which static longerons leave.
    `near` is a point in frame G, shape (3,), m, for instance the first goal.
    """
    space = space or Subspace(box.chain)
    best, most, tried = space.approach(box.middle[None])[0][0], -np.inf, 0
    plain = keep.surroundings.unloaded
    for raw in _groups(box):
        group, good = space.approach(raw)
        q = group[good & inside(box, group)]
        tried += len(q)
        if not len(q):
            continue
        clear = plain.clearance(q)[0]
        enough = np.round(np.minimum(clear, keep.clearance + _ROOM) / _GRAIN)
        away = np.round(np.linalg.norm(box.chain.tool(q)[0] - near, axis=1) / _GRAIN)
        for k in np.lexsort((away, -enough))[:_JUDGED]:
            found = clear[k] if plain is keep.surroundings else keep.surroundings.least(q[k])[0]
            if found > most:
                best, most = q[k], found
            if found >= keep.clearance:
                return np.array(q[k]), tried
    return np.array(best), tried


def _groups(box: StrokeBox) -> Iterator[Array]:
    """Postures to try, shape (S, n) each group, the simplest group first."""
    chain = box.chain
    angles = 2 * np.pi / _AROUND * np.arange(_AROUND)
    patterns = pattern_bends(len(chain.layout.names))
    yield bring_inside(box, np.concatenate([bend_all(chain, patterns, angle) for angle in angles]))
    table = make_postures(box).q
    yield table
    if can_swing(chain):
        for turn in 2 * np.pi / _TURNS * np.arange(1, _TURNS):
            yield swing(chain, table, turn)
