"""Shape control: an arm fitted to a curve segment by segment, then to its end conditions exactly (section 7.4).

A fit gives every module's inputs in closed form, strokes left aside (section 7.4.1). The static sections between two active
modules lie as one chord. A double octahedron has three inputs: they put the end of the chord on the curve, and the modules
before give its direction. An octahedron has six: they put both ends on the curve. Its last face stands at the end of the
curve, along the tangent, turned about it by the twist. Faces are carried along by the smallest turn from each direction to
the next, and the twist is dealt out evenly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.errors import DescriptionError, ReachError
from vgtsim.kinematics import Chain, Chord, order_down, rotation
from vgtsim.positioning.goals import tool_goal
from vgtsim.positioning.methods import solve
from vgtsim.positioning.objectives import Configurations, Nearness
from vgtsim.positioning.problem import Problem
from vgtsim.positioning.solution import Solution, make_column
from vgtsim.positioning.strokes import StrokeBox, bring_inside

MAGNITUDES = np.geomspace(0.25, 4.0, 13)  # of the end tangents, in distances from base to tool
BARRIER = 1e-2  # weight of the stroke barrier beside the nearness to a fit: a tenth of what other objectives have
_TABLE = np.linspace(0.0, 1.0, 401)  # of the curve's parameter, between which places are interpolated
_LEAST = 0.1  # of the straight modules' length that the modules have on a curve too short for the static sections
_STRAIGHT = 1e-9  # m: a section whose top stands this far beside its base's axis is inclined
F = np.array([[1.0, 0.0, -3.0, 2.0], [0.0, 0.0, 3.0, -2.0], [0.0, 1.0, -2.0, 1.0], [0.0, 0.0, -1.0, 1.0]])  # (7.7)
_GAUSS = np.polynomial.legendre.leggauss(8)
_PIECES = 64  # of the parameter for arc lengths


def solve_shapes(problem: Problem, magnitudes: tuple[tuple[float, float], ...] | None = None) -> Solution:
    """Solve a tool goal by all cubic directrices of a search: those that meet it inside the strokes, the least objective first.

    `magnitudes` are pairs of the end tangents', m, 13 by 13 of them when absent. Every solution is as near to its curve's fit as
    it can be; its value is the problem's objective; its notes tell the magnitudes and how far the fit overruns a stroke, m.

    Raises:
        ReachError: The end conditions cannot be met from any fit.
        DescriptionError: The arm has modules that cannot be fitted to a curve; they are named.

    Source: section 7.4 and equations 8.9, 8.10. Differs: equal arc length at once, and an exact end after the fit; the
    objective is that of the arm with its end met, not of the fit.
    """
    box, chain = problem.box, problem.chain
    position, direction = (part.target for part in problem.goal.groups)  # a tool goal's
    goal = tool_goal(position, direction)
    at, along = (part.target for part in goal.groups)
    face = at - chain.manipulator.tip_plate.tool_offset * along
    base, out = chain.mount[:3, 3], chain.mount[:3, 2]
    reach = float(np.linalg.norm(face - base))
    pairs = magnitudes or tuple((float(a), float(b)) for a in reach * MAGNITUDES for b in reach * MAGNITUDES)
    fits = np.array([fit(chain, cubic(base, face, a * out, b * along)) for a, b in pairs])
    overrun = overruns(box, fits)
    # the end conditions exactly and the strokes kept, as near to each fit as may be
    near = bring_inside(box, fits)
    nearness = Nearness(box.lengths(chain.state(near).legs))
    found = solve(Problem(box=box, goal=goal, objective=nearness, barrier=BARRIER), near)
    met = np.flatnonzero(found.met)
    if not len(met):
        best = int(np.argmin(np.linalg.norm(found.error, axis=1)))
        raise unmet_ends(found.error[best], overrun[best])
    value = problem.objective.values(Configurations(box, chain.state(found.q[met]), np.zeros(len(met), int)))
    order = order_down(-value)
    notes = [
        {"tangent magnitudes, m": str(np.round(pairs[i], 3)), "fit beyond strokes, m": float(overrun[i])}
        for i in met[order]
    ]
    return replace(found.pick(met[order]), value=value[order], notes=make_column(notes))


def overruns(box: StrokeBox, q: Array) -> Array:
    """Greatest excess of a length over its stroke, shape (b,), m; infinite where a module does not assemble."""
    state = box.chain.state(q)
    return np.where(state.assembles, -np.min(box.spare(box.lengths(state.legs)), axis=1), np.inf)


def unmet_ends(error: Array, overrun: float) -> ReachError:
    """The error of an arm whose end conditions are not met from a fit."""
    shortfall = float(np.linalg.norm(error[:3]))
    return ReachError("shape", shortfall, (), f"the fit's strokes are overrun by {overrun:.3g} m")


def fit(chain: Chain, curve: Directrix, twist: float = 0.0) -> Array:
    """Inputs, shape (n,), that lay an arm along a curve from its base to its last face, in frame G; strokes left aside.

    The arm begins with an active module. Static sections keep their length along the curve; active modules share the
    rest in proportion to their straight lengths. Octahedra turn the last face about the tangent by the twist, rad.

    Raises:
        DescriptionError: A module cannot be fitted; it is named.

    Source: sections 3.5.4 and 7.4.1. Differs: ends lie on the curve exactly, with sections as chords; faces are carried
    by the smallest turns, because the X-Y-Z angles of 7.12 and 7.13 twist the arm where the tangent passes X.
    """
    _require_fitting(chain)
    layout, row = chain.layout, np.empty(chain.layout.inputs)
    begins, directions, ends = _lay_out(chain, curve)
    share = rotation([0.0, 0.0, twist / len(layout.names)])
    R, P = chain.mount[:3, :3], chain.mount[:3, 3]
    for a, (place, m) in enumerate(chain.seats):
        begin, end = R.T @ (begins[a] - P), R.T @ (ends[a] - P)
        chord = Chord(begin, R.T @ directions[a], end, float(layout.after[a, 2, 3]))
        row[place.columns[m]], top, end = place.modules.lay(m, chord, share)
        R, P = R @ top @ layout.after[a, :3, :3], P + R @ end
    return row


def _require_fitting(chain: Chain) -> None:
    layout, found = chain.layout, f"shape control of {chain.manipulator.name}"
    for place in layout.places:
        for m, a in enumerate(place.active):
            whole = place.modules.is_free(m)
            inclined = bool(np.any(np.abs(layout.after[a, :2, 3]) > _STRAIGHT) or layout.after[a, 2, 2] < 1 - _STRAIGHT)
            if not whole or inclined:
                detail = "followed by a section with inclined faces" if whole else "a hinge or static longerons"
                allowed = "double octahedra, octahedra with six actuators and sections with parallel faces"
                raise DescriptionError(None, "method", f"{found}: {layout.names[a]} has {detail}", allowed)
    if np.any(layout.root != np.eye(4)):
        raise DescriptionError(None, "method", found, "an arm that begins with an active module")


def _lay_out(chain: Chain, curve: Directrix) -> tuple[Array, Array, Array]:
    """Begins, m, unit directions, and ends on a curve, m, of the static sections after A active modules, each of shape (A, 3)."""
    static = chain.layout.after[:, 2, 3]
    arc = arc_length(curve, _TABLE)
    modules = _straight_lengths(chain)
    share = modules / modules.sum() * max(arc[-1] - static.sum(), _LEAST * modules.sum())
    end = np.cumsum(share + static)
    scale = arc[-1] / end[-1]
    ends = curve.point(np.interp(scale * end, arc, _TABLE))
    begin = curve.point(np.interp(scale * (end - static), arc, _TABLE))
    way = np.where(static[:, None] > _STRAIGHT, ends - begin, curve.tangent(np.interp(scale * end, arc, _TABLE)))
    way[-1] = curve.tangent(np.ones(1))[0]
    direction = way / np.linalg.norm(way, axis=1, keepdims=True)
    ends[-1] = curve.point(np.ones(1))[0]
    begin[-1] = ends[-1] - static[-1] * direction[-1]
    return begin, direction, ends


def _straight_lengths(chain: Chain) -> Array:
    """Distance between the end faces of each straight active module, shape (A,), m."""
    found = np.empty(len(chain.layout.names))
    for place in chain.layout.places:
        found[place.active] = np.linalg.norm(place.modules.at(place.modules.straight[None]).frame[0, ..., 3], axis=-1)
    return found


@dataclass(frozen=True)
class Directrix:
    """A curve over u in [0, 1]: positions, m, and derivatives by u, shape (k, 3), of parameters u of shape (k,)."""

    point: Callable[[Array], Array]
    tangent: Callable[[Array], Array]


def cubic(start: ArrayLike, end: ArrayLike, first: ArrayLike, last: ArrayLike) -> Directrix:
    """The cubic with end points C(0), C(1) and end tangents C'(0), C'(1), each of shape (3,), m.

    Source: equations 7.3 to 7.8 and A.1 to A.9.
    """
    A = np.stack([np.asarray(item, float) for item in (start, end, first, last)], axis=1) @ F

    def point(u: Array) -> Array:
        return np.stack([np.ones_like(u), u, u**2, u**3], axis=-1) @ A.T

    def tangent(u: Array) -> Array:
        return np.stack([np.zeros_like(u), np.ones_like(u), 2 * u, 3 * u**2], axis=-1) @ A.T

    return Directrix(point, tangent)


def arc_length(curve: Directrix, u: ArrayLike) -> Array:
    """Length of the curve from its start to each u, shape (k,), m: Gauss and Legendre's rule on 64 pieces."""
    at = np.asarray(u, float)
    begin = np.minimum(np.floor(at * _PIECES), _PIECES - 1) / _PIECES
    whole = _lengths_between(curve, np.arange(_PIECES) / _PIECES, np.full(_PIECES, 1 / _PIECES))
    before = np.concatenate([[0.0], np.cumsum(whole)])[np.rint(begin * _PIECES).astype(int)]
    return before + _lengths_between(curve, begin, at - begin)


def _lengths_between(curve: Directrix, begin: Array, step: Array) -> Array:
    """Length of each piece, shape (k,), m, that begins at some u and goes on by a step, shape (k,) each."""
    node, weight = (_GAUSS[0] + 1) / 2, _GAUSS[1] / 2
    at = begin[:, None] + step[:, None] * node
    speed = np.linalg.norm(curve.tangent(at.ravel()), axis=-1).reshape(at.shape)
    return step * (speed @ weight)
