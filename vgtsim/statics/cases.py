"""Load cases: weight, payload, tool wrench, static seismic coefficients and dynamic factors, and their envelope."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description.scene import LoadCase
from vgtsim.statics.equilibrium import MemberForces, solve
from vgtsim.statics.loads import LoadModel, tool_forces
from vgtsim.statics.motion import Motion
from vgtsim.statics.rating import Section, rate, utilise

Array = NDArray[np.float64]

_AXIAL = ("near_axial", "bar", "far_axial")


@dataclass(frozen=True)
class Envelope:
    """Worst over cases; C cases, ... poses, M members.

    Attributes:
        cases: Names of the cases.
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


def apply_case(model: LoadModel, case: LoadCase) -> LoadModel:
    """Load model of a case, without its wrench and without what comes from any direction.

    Args:
        model: Masses under plain gravity.
        case: The case.

    Returns:
        With gravity turned and scaled; the payload's mass carries what its factor differs from that of the arm.
    """
    size = float(np.linalg.norm(model.gravity))
    return _factored(model, case, case.dead * (case.dynamic * model.gravity + size * np.array(case.seismic)))


def _factored(model: LoadModel, case: LoadCase, gravity: Array) -> LoadModel:
    """With another gravity, the dead load's factor in it, and the payload's mass set against that factor."""
    mass = model.payload.mass * case.payload / case.dead
    return replace(model, gravity=gravity, payload=model.payload.model_copy(update={"mass": mass}))


def solve_case(model: LoadModel, nodes: ArrayLike, case: LoadCase, motion: Motion | None = None) -> MemberForces:
    """Find the member forces of a case, without what comes from any direction.

    Args:
        model: Masses under plain gravity.
        nodes: Shape (..., N, 3), m, in frame G.
        case: The case.
        motion: Of the nodes; the inertia of the arm and of the factored payload comes on top. Absent at rest.

    Returns:
        The forces.

    Raises:
        TrussError: The truss is a mechanism or carries a self-stress.
    """
    n = np.asarray(nodes, float)
    wrench = np.array([*case.force, *case.moment])
    still = solve(apply_case(model, case), n, nodal_forces=tool_forces(model, n, wrench))
    if motion is None:
        return still
    payload = model.payload.model_copy(update={"mass": case.payload * model.payload.mass})
    inertia = solve(replace(model, gravity=np.zeros(3), payload=payload), n, motion)
    return _combine(still, inertia, 1.0, (*_AXIAL, "near_transverse", "reaction"))


def bound_case(
    model: LoadModel, nodes: ArrayLike, case: LoadCase, motion: Motion | None = None
) -> tuple[MemberForces, MemberForces]:
    """Find the greatest and least axial forces of a case whose shaking and reaction may come from any direction.

    A force is linear in a load, so what a load of given size can add to it is the length of the vector of what unit
    loads along the axes add: of two axes for shaking, of three for the reaction. Each member has its own worst direction.

    Args:
        model: Masses under plain gravity.
        nodes: Shape (..., N, 3), m, in frame G.
        case: The case.
        motion: Of the nodes; absent at rest.

    Returns:
        The most pulled and the most pushed state of every member; transverse forces and reactions are those without
        what comes from any direction.

    Raises:
        TrussError: The truss is a mechanism or carries a self-stress.
    """
    n = np.asarray(nodes, float)
    middle = solve_case(model, n, case, motion)
    size = float(np.linalg.norm(model.gravity))
    spans = []
    if case.shaking:
        pulls = case.shaking * case.dead * size * np.eye(3)[:2]
        spans.append([solve(_factored(model, case, pull), n) for pull in pulls])
    if case.reaction:
        free = replace(model, gravity=np.zeros(3))
        wrenches = case.reaction * np.eye(6)[:3]
        spans.append([solve(free, n, nodal_forces=tool_forces(model, n, wrench)) for wrench in wrenches])
    high = low = middle
    for effects in spans:
        spread = replace(middle, **{name: _length([getattr(item, name) for item in effects]) for name in _AXIAL})
        high, low = _combine(high, spread, 1.0), _combine(low, spread, -1.0)
    return high, low


def _length(parts: Sequence[Array]) -> Array:
    return np.linalg.norm(np.stack(parts), axis=0)


def _combine(forces: MemberForces, others: MemberForces, sign: float, names: tuple[str, ...] = _AXIAL) -> MemberForces:
    """With some fields of others added."""
    return replace(forces, **{name: getattr(forces, name) + sign * getattr(others, name) for name in names})


def find_envelope(
    model: LoadModel, section: Section, nodes: ArrayLike, cases: Sequence[LoadCase], safety_factor: float
) -> Envelope:
    """Hold every case against the ratings in every pose.

    Args:
        model: Masses under plain gravity.
        section: Section properties.
        nodes: Poses, shape (..., N, 3), m, in frame G.
        cases: At least one.
        safety_factor: Omega of AISC 360.

    Returns:
        The envelope.

    Raises:
        TrussError: The truss is a mechanism or carries a self-stress.
    """
    n = np.asarray(nodes, float)
    ends = model.truss.ends
    ratings = rate(section, np.linalg.norm(n[..., ends[:, 1], :] - n[..., ends[:, 0], :], axis=-1), safety_factor)
    strength, pressure = [], []
    pull, push = np.zeros(len(ends)), np.zeros(len(ends))
    for case in cases:
        high, low = bound_case(model, n, case)
        pull = np.maximum(pull, _along(high).reshape(-1, len(ends)).max(axis=0))
        push = np.maximum(push, -_along(low).reshape(-1, len(ends)).min(axis=0))
        used = utilise(ratings, high), utilise(ratings, low)
        strength.append(np.maximum(used[0].strength, used[1].strength))
        pressure.append(np.maximum(used[0].pressure, used[1].pressure))
    return Envelope(tuple(case.name for case in cases), pull, push, np.stack(strength), np.stack(pressure))


def _along(forces: MemberForces) -> Array:
    """Axial forces at the near hub, between and at the far hub, shape (3, ..., M), N."""
    return np.stack([getattr(forces, name) for name in _AXIAL])
