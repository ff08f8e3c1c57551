"""Natural modes of an elastic arm: consistent masses of the members, cylinder segments included, and stiffness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigh

from vgtsim.arrays import Array, Index
from vgtsim.errors import TrussError
from vgtsim.kinematics import MemberInertia, Truss, first_greatest
from vgtsim.statics.blocks import block_moves, ring_stiffness
from vgtsim.statics.elasticity import ElasticModel
from vgtsim.statics.loads import hub_loads
from vgtsim.statics.stiffness import band_matrix, deflect, node_loads, pattern_of, scatter, unknowns_of
from vgtsim.statics.stiffness_matrix import (
    add_blocks,
    geometric_blocks,
    is_sound,
    make_pattern,
    require_stiff,
    softest,
    unfold,
)

_MASSLESS = 1e-12  # smallest eigenvalue of the mass matrix, its diagonal scaled to one: rounding leaves 1e-16,
# a payload of 100 t on massless hubs 1e-4


@dataclass(frozen=True)
class NaturalModes:
    """Natural modes, slowest first: frequency, shape (n,), Hz, and nodes, shape (n, N, 3), m.

    `nodes` are their displacements in each mode for a modal mass of 1 kg.
    """

    frequency: Array
    nodes: Array


def find_modes(model: ElasticModel, nodes: ArrayLike, count: int = 6) -> NaturalModes:
    """Find the slowest natural modes about a pose of shape (N, 3), m, frame G.

    The member forces under weight stiffen (pulled) and soften (pushed) the arm; a model without gravity has plain modes.

    Raises:
        TrussError: The truss is a mechanism; members are named. Or something of it has no mass.

    Source: generalised eigenvalue problem K v = omega² M v; consistent masses as for a rigid line between its two
        hubs, see `member_loads`.
    """
    n = np.asarray(nodes, float)
    matrices, mass = band_matrix(model, n[None]), mass_matrix(model, n)
    require_stiff(model.truss, n[None], matrices)
    _require_mass(model, mass)
    stiff = unfold(matrices.upper[0]) + geometric_stiffness(model, n)
    last = min(count, len(stiff)) - 1
    square, shape = eigh(stiff, mass, subset_by_index=[0, last])
    moved = scatter(model.truss, np.broadcast_to(n, (last + 1, *n.shape)), shape.T)
    return NaturalModes(np.sqrt(np.maximum(square, 0.0)) / (2 * np.pi), moved)


def damping_time(model: ElasticModel, nodes: ArrayLike, ratio: float) -> float:
    """Damper over stiffness beta, s, the same for every member, that gives the slowest mode a ratio of critical damping.

    The mode is taken in the unloaded pose `nodes`, shape (N, 3), m. Mode i then has ratio beta omega_i / 2.
    Source: damping proportional to stiffness, J. W. Strutt (Lord Rayleigh), The Theory of Sound (1877).
    """
    return ratio / (np.pi * float(find_modes(model, nodes, 1).frequency[0]))


def geometric_stiffness(model: ElasticModel, nodes: ArrayLike) -> Array:
    """Stiffness that the member forces under weight add, symmetric, shape (n, n), for nodes of shape (N, 3), m.

    A pulled member resists turning by its force over its length. The forces on the tip plate, weight and members, keep
    their directions to first order; as the plate turns, their points of attack move to second order.
    """
    n, truss, loads = np.asarray(nodes, float), model.truss, model.loads
    bar, span = deflect(model, n).bar, truss.spans(n)
    near, far = _moves(truss, n, truss.ends)
    total = add_blocks(pattern_of(truss), geometric_blocks(span, bar, far - near))
    force = bar[:, None] * (span / np.linalg.norm(span, axis=-1)[:, None])
    # of the members: weight here, their forces next
    pull = node_loads(model, n[None])[0] - hub_loads(loads, n[None])[0]
    np.add.at(pull, truss.ends[:, 0], force)
    np.add.at(pull, truss.ends[:, 1], -force)
    if len(truss.rings):
        dof = np.array(unknowns_of(truss))[truss.rings[:, 0, 0]]
        total[dof[:, :, None], dof[:, None, :]] += ring_stiffness(truss, n, pull + hub_loads(loads, n[None])[0])
    outer = np.einsum("ni,nj->ij", pull[truss.tip], _levers(model, n))
    # the plate's own weight acts at its centre of mass, off the plane of the tip nodes
    mass, centre = _tip_mass(model, n)
    outer += np.outer(mass * loads.gravity, centre)
    total[-3:, -3:] += np.trace(outer) * np.eye(3) - (outer + outer.T) / 2
    return total


def mass_matrix(model: ElasticModel, nodes: ArrayLike) -> Array:
    """Mass matrix of the unknowns, symmetric, shape (n, n), kg, kg·m and kg·m², for nodes of shape (N, 3), m."""
    n, truss, loads = np.asarray(nodes, float), model.truss, model.loads
    total = add_blocks(pattern_of(truss), _weigh(truss, n, truss.ends, loads.members))
    free = np.arange(len(total) - 6)
    total[free, free] += np.repeat(loads.hub_mass[truss.free], 3)
    if len(truss.rings):
        ends = truss.rings[:, :, [0, 2]].reshape(-1, 2)
        posts = make_pattern(unknowns_of(truss), tuple(map(tuple, ends.tolist())))
        total += add_blocks(posts, _weigh(truss, n, ends, loads.blocks, loads.hub_mass[ends]))
    total[-6:, -6:] += _tip_inertia(model, n)
    return total


def _weigh(truss: Truss, nodes: Array, ends: Index, part: MemberInertia, more: Array | float = 0.0) -> Array:
    """Mass matrices of bars of two segments with more mass at their ends, (B, 2), kg; shape (B, 2 w, 2 w), see `Pattern`."""

    def weighed(weight: Array, left: Array, right: Array) -> Array:
        return np.swapaxes(weight[:, None, None] * left, 1, 2) @ right

    span = nodes[ends[:, 1]] - nodes[ends[:, 0]]
    length = np.linalg.norm(span, axis=-1)
    unit = span / length[:, None]
    across = np.eye(3) - unit[:, :, None] * unit[:, None, :]
    near, far = _moves(truss, nodes, ends)
    turn = across / length[:, None, None] @ (far - near)
    blocks, mass = weighed(part.about_end.sum(axis=1), turn, turn), part.mass + more
    for end, side, sign in ((near, 0, 1.0), (far, 1, -1.0)):
        mixed = sign * weighed(part.first_moment[:, side], end, turn)
        blocks += weighed(mass[:, side], end, end) + mixed + np.swapaxes(mixed, 1, 2)
    return blocks


def _require_mass(model: ElasticModel, mass: Array) -> None:
    """Refuse a motion that no mass takes part in; a description cannot hold one, an edited copy of a model can."""
    pattern = pattern_of(model.truss)
    if is_sound(mass, pattern, _MASSLESS):
        return
    value, modes = softest(mass, pattern, _MASSLESS)
    truss, size = model.truss, np.linalg.norm(modes, axis=1)
    moved = np.zeros(len(truss.nodes))
    moved[truss.free] = size[:-6].reshape(-1, 3).max(axis=1)
    moved[truss.tip] = size[-6:].max()
    node = int(first_greatest(moved))
    members = tuple(m.name for m in truss.members if node in m.ends)
    detail = f"no mass moves with {truss.nodes[node]}: smallest scaled eigenvalue of the mass {value:.2g}"
    raise TrussError(len(mass), members, f"{detail}, sound from {_MASSLESS:.0e}")


def _levers(model: ElasticModel, nodes: Array) -> Array:
    """Tip nodes from their centroid, shape (3, 3), m."""
    return nodes[model.truss.tip] - nodes[model.truss.tip].mean(axis=0)


def _moves(truss: Truss, nodes: Array, ends: Index) -> tuple[Array, Array]:
    """Displacements of the ends of bars, shape (B, 2), per unit of the unknowns of both ends, each of shape (B, 3, 2 w)."""
    width = 9 if len(truss.rings) else 6
    moves = np.zeros((len(nodes), 3, width))
    moves[:, :, :3] = np.eye(3)
    lever = nodes - nodes[truss.tip].mean(axis=0)
    moves[:, :, 3:6] = np.swapaxes(np.cross(np.eye(3)[None], lever[:, None]), 1, 2)
    if len(truss.rings):
        moves[truss.rings[:, :, [0, 2]]] = block_moves(truss, nodes)
    near, far = moves[ends].swapaxes(0, 1)
    none = np.zeros(near.shape)
    return np.concatenate([near, none], axis=-1), np.concatenate([none, far], axis=-1)


def _tip_mass(model: ElasticModel, nodes: Array) -> tuple[float, Array]:
    """Mass of tip plate, corner hubs and payload, kg, and its centre from the tip's centroid, shape (3,), m."""
    loads, corners = model.loads, model.loads.hub_mass[model.truss.tip]
    mass = loads.plate.mass + loads.payload.mass + float(corners.sum())
    payload = _tip_axes(model, nodes)[2] * loads.tool_offset * loads.payload.mass
    return mass, (payload + corners @ _levers(model, nodes)) / mass


def _tip_axes(model: ElasticModel, nodes: Array) -> Array:
    """Axes x, y, z of the tip plate in frame G, shape (3, 3)."""
    n1, n2, n3 = nodes[model.truss.tip]
    x, z = (n1 - n3) / np.linalg.norm(n1 - n3), np.cross(n1 - n3, n2 - n3)
    z /= np.linalg.norm(z)
    return np.array([x, np.cross(z, x), z])


def _tip_inertia(model: ElasticModel, nodes: Array) -> Array:
    """Mass matrix of the rigid tip about its centroid, shape (6, 6)."""
    loads, axes, lever = model.loads, _tip_axes(model, nodes), _levers(model, nodes)
    ball = loads.payload.mass * loads.payload.radius**2 / 5  # second moment of a solid ball about its centre
    tool = loads.tool_offset * axes[2]
    spread = np.einsum("i,ij,ik->jk", np.array(loads.plate.second_moments) + ball, axes, axes)
    spread += loads.payload.mass * np.outer(tool, tool) + (loads.hub_mass[model.truss.tip, None] * lever).T @ lever
    mass, centre = _tip_mass(model, nodes)
    mixed = mass * np.cross(np.eye(3), centre)
    return np.block([[mass * np.eye(3), mixed.T], [mixed, np.trace(spread) * np.eye(3) - spread]])
