"""What an arm may carry where: allowable payload and sag over the vertical plane, with the member that governs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index, Mask
from vgtsim.constants import GRAVITY, PAYLOAD, PAYLOAD_RADIUS, SAFETY_FACTOR
from vgtsim.description import Payload
from vgtsim.errors import TrussError
from vgtsim.kinematics import Chain, bend_all, first_least, sample_inputs, within_strokes
from vgtsim.statics.elasticity import make_elastic_model
from vgtsim.statics.equilibrium import MemberForces, blend, solve_members
from vgtsim.statics.loads import make_load_model
from vgtsim.statics.rating import LIMITS, Ratings, make_sections, rate
from vgtsim.statics.stiffness import deflect
from vgtsim.statics.utilisation import utilise

_UNIT = 1000.0  # payload of the second load, kg
GREATEST_BEND = np.pi / 4  # of a module, rad
_ROUND = 2000  # shapes solved at a time
_HALVINGS = 60  # of the range of a payload: what is left of 1e9 kg is rounding
_DOUBLINGS = 24  # of a unit of payload taken away, until an actuator that is bent too far by the arm's own weight holds
GOVERNING = (*LIMITS, "axial force with bending")  # what may govern an allowance


@dataclass(frozen=True)
class Allowance:
    """Allowable payload of a batch of poses, shape (...), kg: the greatest mass at the tool with every utilisation at most 1.

    It is negative where the arm cannot hold its own weight, minus infinity where no load in place of a payload relieves a
    bent actuator. `member` and `limit` index the member and the one of `GOVERNING` that govern, shape (...).
    """

    payload: Array
    member: Index
    limit: Index


@dataclass(frozen=True)
class CapacityMap:
    """One posture in each of C cells of the vertical plane that can be reached, with inputs q of shape (C, n).

    Attributes:
        radius: Of the cell's middle from the mast's axis, shape (C,), m.
        depth: Of the cell's middle below the pivot, shape (C,), m.
        payload: Allowable, shape (C,), kg.
        sag: Displacement of the tool under the reference payload, shape (C,), m.
        member: Name of the governing member of each cell.
        limit: The limit of it that governs.
        reference: Payload of the sag, kg.
        bends: Angle between the end faces of each active module, shape (C, A), rad.
        azimuths: Direction each active module bends to, from the x axis of its base frame, shape (C, A), rad.
    """

    radius: Array
    depth: Array
    payload: Array
    sag: Array
    member: tuple[str, ...]
    limit: tuple[str, ...]
    q: Array
    reference: float
    bends: Array
    azimuths: Array


def find_allowance(chain: Chain, nodes: ArrayLike, gravity: float, safety_factor: float, radius: float) -> Allowance:
    """Find the payload at which the first member or cylinder is used to the full, in poses of shape (..., N, 3), m, frame G.

    Member forces are linear in the payload, so two solves give it exactly; use in bending is not linear, and the payload at
    which it is full is found by halving. `radius` is the payload's, m. Errors are those of `solve_members`.
    """
    n, payloads = np.asarray(nodes, float), [Payload(mass=mass, radius=radius) for mass in (0.0, _UNIT)]
    empty, loaded = (solve_members(make_load_model(chain, payload, gravity), n) for payload in payloads)
    ratings = rate(make_sections(chain), chain.truss.lengths(n), safety_factor)
    force, growth, rows = empty.along, (loaded.along - empty.along) / _UNIT, []
    for name, (pull, push) in ratings.limits.items():
        part = slice(1, 2) if name == "oil pressure" else slice(None)  # a drive feels its bar force alone
        rows.append(_find_room(force[part], growth[part], pull, push))
    rows.append(_find_bending_room(chain, empty, loaded, ratings, np.min(rows, axis=0)))
    room = np.stack(rows, axis=-1)
    flat = room.reshape(*room.shape[:-2], -1)
    worst = first_least(flat, axis=-1)  # members that mirror one another carry the same
    return Allowance(flat.min(axis=-1), worst // len(GOVERNING), worst % len(GOVERNING))


def _find_bending_room(
    chain: Chain, empty: MemberForces, loaded: MemberForces, ratings: Ratings, axial: Array
) -> Array:
    """Payload at which each member is bent to the full, shape (..., M), kg; endless for members that nothing bends.

    `axial` is that at which axial force alone is full, which is never less. Between the two ends of the range that is halved
    use passes one upward.
    """
    room, bent = np.full(axial.shape, np.inf), chain.truss.ring_actuators.ravel()
    if not len(bent):
        return room
    first, last = empty.of(bent), loaded.of(bent)
    strength = ratings.of(bent)

    def stands(payload: Array) -> Mask:
        return utilise(strength, blend(first, last, payload / _UNIT)).bent <= 1.0

    top = np.maximum(axial[..., bent], 0.0)
    low = np.zeros(top.shape)
    for count in range(_DOUBLINGS):
        low = np.where(stands(low), low, -(2.0**count))
    hopeless, high = ~stands(low), top
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        good = stands(middle)
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    room[..., bent] = np.where(hopeless, -np.inf, high)
    return room


def _find_room(force: Array, growth: Array, pull: ArrayLike, push: ArrayLike) -> Array:
    """Payload at which the force of each member reaches its limit, shape (..., M), kg."""
    bound = np.where(growth > 0, pull, push)
    rate_of = np.maximum(np.abs(growth), 1e-12)  # N/kg: a member that the payload does not load gets endless room
    return np.min((bound - np.sign(growth) * force) / rate_of, axis=0)


def draw_shapes(chain: Chain, shapes: int = 20000, seed: int = 1) -> Array:
    """Inputs of shapes drawn in the vertical plane of azimuth zero, shape (K, n).

    Each module is bent in the plane by up to 45 degrees at its straight extension; shapes outside a stroke are dropped.
    An arm with modules that do not all bend in any plane has half of its shapes drawn so; the lengths of the others are
    evenly spread over the strokes, in the plane or out of it.

    Raises:
        TrussError: No shape is within the strokes.
    """
    rng, active = np.random.default_rng(seed), len(chain.layout.names)
    drawn = shapes if chain.leans else shapes // 2
    # evenly curved arms as well as free ones: the former reach far, the latter fill the plane
    bend = GREATEST_BEND * rng.uniform(-1, 1, (drawn, active))
    even = rng.uniform(0, 1, (drawn, 1)) < 0.5
    bend = np.where(even, 0.7 * bend[:, :1] * np.linspace(1, -1, active) ** 2 + 0.3 * bend, bend)
    q = bend_all(chain, bend, 0.0)
    q = q[within_strokes(chain, q)]
    if not chain.leans:
        q = np.concatenate([q, sample_inputs(chain, shapes - drawn, seed)])
    if not len(q):
        raise TrussError(0, (), f"none of {shapes} shapes is within the strokes")
    return q


def map_capacity(
    chain: Chain,
    q: ArrayLike,
    gravity: float = GRAVITY,
    safety_factor: float = SAFETY_FACTOR,
    reference: float = PAYLOAD,
    cell: float = 0.5,
) -> CapacityMap:
    """Map the allowable payload over radius and depth: of the postures in each cell, the one that carries most.

    The arm hangs; depth counts from its base face. Inputs q have shape (K, n); `reference` is the payload of the sag, kg;
    `cell` is the side of a cell, m. Errors are those of `solve_members`.
    """
    postures, pivot = np.asarray(q, float), chain.mount[:3, 3]
    tool, _ = chain.tool(postures)
    radius, depth = np.linalg.norm(tool[:, :2] - pivot[:2], axis=1), pivot[2] - tool[:, 2]
    column, row = np.floor(np.stack([radius, depth]) / cell)
    parts = [
        find_allowance(chain, chain.nodes(postures[i : i + _ROUND]), gravity, safety_factor, PAYLOAD_RADIUS)
        for i in range(0, len(postures), _ROUND)
    ]
    payload, member, limit = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("payload", "member", "limit")
    )
    best = np.lexsort((-payload, row, column))  # cell by cell, the greatest payload of a cell first
    best = best[np.unique(np.stack([column[best], row[best]]), axis=1, return_index=True)[1]]
    state = chain.state(postures[best])
    normal = np.einsum(
        "cakj,cak->caj", state.base[:, :-1, :, :3], state.top[..., 2]
    )  # of tops in frames of their bases
    elastic = make_elastic_model(chain, Payload(mass=reference, radius=PAYLOAD_RADIUS), gravity)
    return CapacityMap(
        radius=(column[best] + 0.5) * cell,
        depth=(row[best] + 0.5) * cell,
        payload=payload[best],
        sag=np.linalg.norm(deflect(elastic, chain.nodes(postures[best])).tool[:, :3], axis=1),
        member=tuple(chain.truss.member_names[i] for i in member[best]),
        limit=tuple(GOVERNING[i] for i in limit[best]),
        q=postures[best],
        reference=reference,
        bends=np.arctan2(np.hypot(normal[..., 0], normal[..., 1]), normal[..., 2]),
        azimuths=np.arctan2(normal[..., 1], normal[..., 0]),
    )


def find_gain(better: CapacityMap, plain: CapacityMap) -> Array:
    """Part by which one map's payload is above another's with cells of the same side, in the cells that both have, shape (C,)."""
    cells, before = (list(zip(item.radius.tolist(), item.depth.tolist(), strict=True)) for item in (better, plain))
    then = dict(zip(before, plain.payload, strict=True))
    pairs = zip(cells, better.payload, strict=True)
    return np.array([now / then[cell] - 1 for cell, now in pairs if cell in then])
