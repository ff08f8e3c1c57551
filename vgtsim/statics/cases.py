"""Load cases: weight, payload, tool wrench, static seismic coefficients and dynamic factors, and their envelope."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description.scene import LoadCase
from vgtsim.statics.equilibrium import MemberForces, solve_members
from vgtsim.statics.loads import LoadModel, tool_forces
from vgtsim.statics.motion import NodeMotion
from vgtsim.statics.rating import MemberSections, rate
from vgtsim.statics.utilisation import utilise

Array = NDArray[np.float64]

_AXIAL = ("near_axial", "bar", "far_axial")
_MOMENTS = ("near_moment", "far_moment")


@dataclass(frozen=True)
class Envelope:
    """Worst over C named cases and ... poses, for M members.

    Attributes:
        tension: Greatest tension of each member over cases and poses, shape (M,), N; 0 when never pulled.
        compression: Greatest compression, positive, shape (M,), N; 0 when never pushed.
        strength: Utilisation of each member in each case, shape (C, ..., M).
        pressure: Drive force over capacity of each member in each case, shape (C, ..., M).
    """

    cases: tuple[str, ...]
    tension: Array
    compression: Array
    strength: Array
    pressure: Array


def _size(model: LoadModel) -> float:
    """Size of gravity, m/s²."""
    return float(np.linalg.norm(model.gravity))


def _factored(model: LoadModel, case: LoadCase, gravity: Array) -> LoadModel:
    """With another gravity, the dead load's factor in it, and the payload's mass set against that factor."""
    mass = model.payload.mass * case.payload / case.dead
    return replace(model, gravity=gravity, payload=model.payload.model_copy(update={"mass": mass}))


def solve_case(model: LoadModel, nodes: ArrayLike, case: LoadCase, motion: NodeMotion | None = None) -> MemberForces:
    """Find the member forces of a case in poses of shape (..., N, 3), m, frame G, without loads from any direction.

    The model is of plain gravity. In a motion, the inertia of the arm and of the factored payload comes on top.

    Raises:
        TrussError: The truss is a mechanism or carries a self-stress.
    """
    n, wrench = np.asarray(nodes, float), np.array([*case.force, *case.moment])
    gravity = case.dead * (case.dynamic * model.gravity + _size(model) * np.array(case.seismic))
    still = solve_members(_factored(model, case, gravity), n, nodal_forces=tool_forces(model, n, wrench))
    if motion is None:
        return still
    payload = model.payload.model_copy(update={"mass": case.payload * model.payload.mass})
    inertia = solve_members(replace(model, gravity=np.zeros(3), payload=payload), n, motion)
    return _combine(still, inertia, 1.0, (*_AXIAL, *_MOMENTS, "near_transverse", "reaction"))


def bound_case(
    model: LoadModel, nodes: ArrayLike, case: LoadCase, motion: NodeMotion | None = None
) -> tuple[MemberForces, MemberForces]:
    """Find the greatest and least forces and moments of a case whose shaking and reaction may come from any direction.

    A force is linear in a load, so a load of given size and any direction adds to it the length of the vector of effects of
    unit loads along the axes: two axes for shaking, three for the reaction. Each member has its own worst direction. So has
    the moment at each of its ends, which is about one line whatever the load (see `_find_rings` in `equilibrium`).

    Arguments are as for `solve_case`. The most pulled and the most pushed state of every member are returned, with the ends
    of the range of the moments at its hubs; which end goes with which force or with which end at the other hub is not said.
    Transverse forces and reactions are those without loads from any direction.

    Raises:
        TrussError: The truss is a mechanism or carries a self-stress.
    """
    n = np.asarray(nodes, float)
    middle = high = low = solve_case(model, n, case, motion)
    spans = []
    if case.shaking:
        pulls = case.shaking * case.dead * _size(model) * np.eye(3)[:2]
        spans.append([solve_members(_factored(model, case, pull), n) for pull in pulls])
    if case.reaction:
        free = replace(model, gravity=np.zeros(3))
        forces = [tool_forces(model, n, wrench) for wrench in case.reaction * np.eye(6)[:3]]
        spans.append([solve_members(free, n, nodal_forces=force) for force in forces])
    lines = {name: _line([getattr(item, name) for effects in spans for item in effects]) for name in _MOMENTS if spans}
    for effects in spans:
        parts = {name: np.stack([getattr(item, name) for item in effects]) for name in (*_AXIAL, *_MOMENTS)}
        sizes = {name: np.linalg.norm(parts[name], axis=0) for name in _AXIAL}
        turns = {name: np.linalg.norm(parts[name], axis=(0, -1))[..., None] * line for name, line in lines.items()}
        spread = replace(middle, **sizes, **turns)
        high, low = _combine(high, spread, 1.0), _combine(low, spread, -1.0)
    return high, low


def _line(moments: Sequence[Array]) -> Array:
    """Unit vector along which all of some parallel vectors lie, shape (..., M, 3); zero where they are."""
    stack = np.stack(moments)
    size = np.linalg.norm(stack, axis=-1, keepdims=True)
    most = np.argmax(size, axis=0)[None]
    longest, length = (np.take_along_axis(item, most, axis=0)[0] for item in (stack, size))
    return np.divide(longest, length, out=np.zeros_like(longest), where=length > 0)


def _combine(
    forces: MemberForces, others: MemberForces, sign: float, names: tuple[str, ...] = (*_AXIAL, *_MOMENTS)
) -> MemberForces:
    """With some fields of others added."""
    return replace(forces, **{name: getattr(forces, name) + sign * getattr(others, name) for name in names})


def find_envelope(
    model: LoadModel, sections: MemberSections, nodes: ArrayLike, cases: Sequence[LoadCase], safety_factor: float
) -> Envelope:
    """Hold every case, at least one, against the ratings in every pose, shape (..., N, 3), m, frame G.

    The model is of plain gravity.

    Raises:
        TrussError: The truss is a mechanism or carries a self-stress.
    """
    n, count = np.asarray(nodes, float), len(model.truss.members)
    ratings = rate(sections, model.truss.lengths(n), safety_factor)
    strength, pressure = [], []
    pull, push = np.zeros(count), np.zeros(count)
    for case in cases:
        high, low = bound_case(model, n, case)
        pull = np.maximum(pull, high.along.reshape(-1, count).max(axis=0))
        push = np.maximum(push, -low.along.reshape(-1, count).min(axis=0))
        used = [utilise(ratings, state) for state in _corners(high, low)]
        strength.append(np.max([use.strength for use in used], axis=0))
        pressure.append(np.max([use.pressure for use in used], axis=0))
    return Envelope(tuple(case.name for case in cases), pull, push, np.stack(strength), np.stack(pressure))


def _corners(high: MemberForces, low: MemberForces) -> list[MemberForces]:
    """The range's ends with one another: both axial ones, each with either moment at either hub if there are any."""
    if not high.near_moment.any() and not low.near_moment.any():
        return [high, low]
    sides = product((high, low), repeat=3)
    return [replace(axial, near_moment=near.near_moment, far_moment=far.far_moment) for axial, near, far in sides]
