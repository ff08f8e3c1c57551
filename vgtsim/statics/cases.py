"""Load cases: weight, payload, tool wrench, static seismic coefficients and dynamic factors, and their envelope.

Member forces are linear in the loads. So each pose is solved once, for unit loads, and every case adds their effects up.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.description import LoadCase
from vgtsim.statics.equilibrium import Loading, MemberForces, solve_loadings
from vgtsim.statics.loads import LoadModel, tool_forces
from vgtsim.statics.motion import NodeMotion
from vgtsim.statics.rating import MemberSections, rate
from vgtsim.statics.utilisation import utilise

_AXIAL = ("near_axial", "bar", "far_axial")
_MOMENTS = ("near_moment", "far_moment")
_CHUNK = 64  # poses held against the cases at a time: keeps the effects of the unit loads in cache


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


@dataclass(frozen=True)
class Effects:
    """Forces of unit loads on an arm in some poses, from which those of every load case follow.

    Attributes:
        model: The arm, its payload and plain gravity.
        units: Forces with a leading dimension of nine or eleven: a gravity of 1 m/s² along each axis on the arm without
            payload; a force of 1 N on the tool along each axis; a moment of 1 N·m about each; and, in a motion, the
            inertia of the arm without payload and with it.
    """

    model: LoadModel
    units: MemberForces

    def solve(self, case: LoadCase) -> MemberForces:
        """Forces of a case without loads from any direction."""
        gravity = case.dead * (case.dynamic * self.model.gravity + _size(self.model) * np.array(case.seismic))
        weights = self._weigh(case, gravity)
        weights[3:9] += [*case.force, *case.moment]
        weights[9:] = (1 - case.payload, case.payload)[: len(weights) - 9]
        return self._add_up(weights)

    def bound(self, case: LoadCase) -> tuple[MemberForces, MemberForces]:
        """Greatest and least forces and moments of a case whose shaking and reaction may come from any direction.

        A force is linear in a load, so a load of given size and any direction adds to it the length of the vector of effects
        of unit loads along the axes: two axes for shaking, three for the reaction. Each member has its own worst direction.
        So has the moment at each of its ends, which is about one line whatever the load (see `_find_rings` in `equilibrium`).

        The most pulled and the most pushed state of every member are returned, with the ends of the range of the moments
        at its hubs; which end goes with which force or with which end at the other hub is not said. Reactions are those
        without loads from any direction; shears are not worked out and NaN.
        """
        high = low = self.solve(case)
        sets = []
        if case.shaking:
            pulls = case.shaking * case.dead * _size(self.model) * np.eye(3)[:2]
            sets.append(self._add_up(np.stack([self._weigh(case, pull) for pull in pulls])))
        if case.reaction:
            sets.append(self._add_up(case.reaction * np.eye(len(self.units.bar))[3:6]))
        bent = _MOMENTS if len(self.model.truss.rings) else ()
        lines = {name: _line(np.concatenate([getattr(item, name) for item in sets])) for name in bent if sets}
        for effects in sets:
            spread = {name: np.linalg.norm(getattr(effects, name), axis=0) for name in _AXIAL}
            for name, line in lines.items():
                spread[name] = np.linalg.norm(getattr(effects, name), axis=(0, -1))[..., None] * line
            high = replace(high, **{name: getattr(high, name) + value for name, value in spread.items()})
            low = replace(low, **{name: getattr(low, name) - value for name, value in spread.items()})
        return high, low

    def _weigh(self, case: LoadCase, gravity: Array) -> Array:
        """Weights of the unit loads for a gravity with the dead load's factor in it; the payload has a factor of its own."""
        weights = np.zeros(len(self.units.bar))
        weights[:3], weights[3:6] = gravity, self.model.payload.mass * case.payload / case.dead * gravity
        return weights

    def _add_up(self, weights: Array) -> MemberForces:
        """Weighted sum of the effects, or several for weights of shape (k, 9 or 11)."""
        bent = _MOMENTS if len(self.model.truss.rings) else ()
        parts = {name: np.tensordot(weights, getattr(self.units, name), 1) for name in (*_AXIAL, *bent, "reaction")}
        first = self.units.at(0)
        return replace(first, near_transverse=np.broadcast_to(np.nan, first.near_transverse.shape), **parts)


def find_effects(model: LoadModel, nodes: ArrayLike, motion: NodeMotion | None = None) -> Effects:
    """Find the effects of unit loads in poses of shape (..., N, 3), m, frame G; errors as `solve_members`.

    The model is of plain gravity. In a motion, the inertia of the arm and of the factored payload comes on top.
    """
    n = np.asarray(nodes, float)
    loadings = [Loading(item) for item in model.units[:3]]
    loadings += [Loading(None, forces=tool_forces(model, n, wrench)) for wrench in np.eye(6)]
    if motion is not None:
        loadings += [Loading(item, motion) for item in model.units[3:]]
    return Effects(model, solve_loadings(model.truss, n, loadings))


def chunks(nodes: Array, motion: NodeMotion | None = None) -> Iterator[tuple[slice, Array, NodeMotion | None]]:
    """Parts of a flat batch of poses, shape (K, N, 3), and of their motion."""
    for start in range(0, len(nodes), _CHUNK):
        part = slice(start, start + _CHUNK)
        yield part, nodes[part], motion and motion.at(part)


def _size(model: LoadModel) -> float:
    """Size of gravity, m/s²."""
    return float(np.linalg.norm(model.gravity))


def _line(moments: Array) -> Array:
    """Unit vector along which all of k parallel vectors lie, shape (..., M, 3), for (k, ..., M, 3); zero where they are."""
    size = np.linalg.norm(moments, axis=-1, keepdims=True)
    most = np.argmax(size, axis=0)[None]
    longest, length = (np.take_along_axis(item, most, axis=0)[0] for item in (moments, size))
    return np.divide(longest, length, out=np.zeros_like(longest), where=length > 0)


def find_envelope(
    model: LoadModel, sections: MemberSections, nodes: ArrayLike, cases: Sequence[LoadCase], safety_factor: float
) -> Envelope:
    """Hold every case, at least one, against the ratings in every pose, shape (..., N, 3), m, frame G.

    The model is of plain gravity. Errors are those of `solve_members`.
    """
    n, count = np.asarray(nodes, float), len(model.truss.members)
    flat = n.reshape(-1, *n.shape[-2:])
    strength, pressure = np.empty((2, len(cases), len(flat), count))
    pull, push = np.zeros((2, count))
    for part, poses, _ in chunks(flat):
        ratings, effects = rate(sections, model.truss.lengths(poses), safety_factor), find_effects(model, poses)
        for i, case in enumerate(cases):
            high, low = effects.bound(case)
            pull = np.maximum(pull, high.along.max(axis=(0, 1)))
            push = np.maximum(push, -low.along.min(axis=(0, 1)))
            used = [utilise(ratings, state) for state in find_corners(high, low)]
            strength[i, part] = np.max([use.strength for use in used], axis=0)
            pressure[i, part] = np.max([use.pressure for use in used], axis=0)
    whole = (item.reshape(len(cases), *n.shape[:-2], count) for item in (strength, pressure))
    return Envelope(tuple(case.name for case in cases), pull, push, *whole)


def find_corners(high: MemberForces, low: MemberForces) -> list[MemberForces]:
    """Combine the ends of a case's range: both axial ones, each with either moment at either hub if there are any."""
    if not high.near_moment.any() and not low.near_moment.any():
        return [high, low]
    sides = product((high, low), repeat=3)
    return [replace(axial, near_moment=near.near_moment, far_moment=far.far_moment) for axial, near, far in sides]
