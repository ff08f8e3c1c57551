"""Direct stiffness of a whole arm: displacements, member forces and tip compliance over any batch of poses.

Unknowns are the displacements of the free hubs and, for the rigid tip plate with tool and payload, a displacement of its
centroid and a rotation about it. Nodes are numbered from the mast to the tip, so the stiffness matrix is narrow.

Of joint blocks the middles have unknowns; feet and heads follow them, see `blocks`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.kinematics import Truss, cross
from vgtsim.statics.banded_solve import solve_poses
from vgtsim.statics.blocks import block_moves, ring_loads
from vgtsim.statics.elasticity import ElasticModel
from vgtsim.statics.loads import block_loads, hub_loads, member_loads, tool_point
from vgtsim.statics.motion import NodeMotion
from vgtsim.statics.stiffness_matrix import Pattern, Stiffness, assemble, make_pattern

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_CHUNK = 256  # poses assembled at a time: keeps the work arrays in cache


@dataclass(frozen=True)
class Deflection:
    """Linear response of an elastic arm to its loads, in frame G.

    Attributes:
        nodes: Displacements of the nodes, shape (..., N, 3), m.
        tool: Displacement and rotation of the tool point, shape (..., 6), m and rad.
        bar: Axial force where a member's halves, or barrel and rod, meet; tension positive, shape (..., M), N.
    """

    nodes: Array
    tool: Array
    bar: Array


@lru_cache(maxsize=64)
def pattern_of(truss: Truss) -> Pattern:
    """Pattern of an arm's members, see `unknowns_of`."""
    return make_pattern(unknowns_of(truss), tuple(map(tuple, truss.ends.tolist())))


def unknowns_of(truss: Truss) -> tuple[tuple[int, ...], ...]:
    """Unknowns that each node's displacement depends on, six of a node, or nine of an arm with joint blocks; -1 for none.

    A free hub and the middle of a block have their own displacement. A tip node has those of the plate. The foot and the head
    of a block have the displacements of the three middles of their ring.
    """
    free, width = truss.free, 9 if len(truss.rings) else 6
    found = np.full((len(truss.nodes), width), -1)
    found[free, :3] = np.arange(3 * len(free)).reshape(-1, 3)
    found[truss.tip, :6] = 3 * len(free) + np.arange(6)
    for ring in truss.rings:
        found[ring[:, [0, 2]]] = found[ring[:, 1], :3].ravel()
    return tuple(map(tuple, found.tolist()))


@lru_cache(maxsize=64)
def _seated(truss: Truss, side: int) -> tuple[Indices, tuple[Indices, Indices, Indices]]:
    """Members whose near (0) or far (1) end is the foot or the head of a block: ring, block and end."""
    ends = truss.rings[:, :, [0, 2]]
    member = np.flatnonzero(np.isin(truss.ends[:, side], ends))
    order = np.argsort(ends, axis=None)
    place = order[np.searchsorted(ends.ravel()[order], truss.ends[member, side])]
    ring, block, end = np.unravel_index(place, ends.shape)
    return member, (ring, block, end)


def elongations(truss: Truss, nodes: Array) -> Array:
    """Elongation of each member per unit of each unknown of its ends, shape (..., M, 2 w), dimensionless and m.

    Nodes have shape (..., N, 3), m; the 2 w unknowns are in the order of `Pattern.dof`.
    """
    first, second = truss.ends.T
    span = truss.spans(nodes)
    unit = span / np.linalg.norm(span, axis=-1, keepdims=True)
    lever = nodes - nodes[..., truss.tip, :].mean(axis=-2, keepdims=True)
    ends = [-unit, -cross(lever[..., first, :], unit), unit, np.cross(lever[..., second, :], unit)]
    if not len(truss.rings):
        return np.concatenate(ends, axis=-1)
    none, moves = np.zeros(unit.shape), block_moves(truss, nodes)
    found = np.concatenate([*ends[:2], none, *ends[2:], none], axis=-1)
    for side, sign in ((0, -1.0), (1, 1.0)):
        member, seat = _seated(truss, side)
        row = np.einsum(
            "...mi,...mik->...mk", sign * unit[..., member, :], moves[(..., *seat, slice(None), slice(None))]
        )
        found[..., member, 9 * side : 9 * side + 9] = row
    return found


def deflect(
    model: ElasticModel,
    nodes: ArrayLike,
    nodal_forces: ArrayLike | None = None,
    tool_wrench: ArrayLike | None = None,
    *,
    weight: bool = True,
) -> Deflection:
    """Find displacements and member forces under weight and further loads, linear about an unloaded pose (..., N, 3), m.

    Forces on the hubs are broadcast to shape (..., N, 3), N; a force on the tool point and a moment about it to shape
    (..., 6), N and N·m, all in frame G. `weight` says whether gravity acts.

    Raises:
        TrussError: The truss is a mechanism at one of the poses; members are named.

    Source: direct stiffness method, for example W. McGuire, R. H. Gallagher and R. D. Ziemian, Matrix Structural
        Analysis, second edition (2000), chapter 3.
    """
    n = np.asarray(nodes, float)
    batch, flat = n.shape[:-2], n.reshape(-1, *n.shape[-2:])
    force = node_loads(model, flat) if weight else np.zeros(flat.shape)
    if nodal_forces is not None:
        force = force + np.broadcast_to(nodal_forces, n.shape).reshape(flat.shape)
    load, to_centroid = gather(model.truss, flat, force), _tool_to_centroid(model, flat)
    if tool_wrench is not None:
        load[:, -6:] += np.einsum("tij,tj->ti", to_centroid, np.broadcast_to(tool_wrench, (*batch, 6)).reshape(-1, 6))
    moved, bar = _solve(model, flat, load[..., None])
    shift = scatter(model.truss, flat, moved[..., 0])
    tool = np.einsum("tji,tj->ti", to_centroid, moved[:, -6:, 0])
    return Deflection(shift.reshape(n.shape), tool.reshape(*batch, 6), bar[..., 0].reshape(*batch, bar.shape[1]))


def tip_compliance(model: ElasticModel, nodes: ArrayLike) -> Array:
    """Displacement and rotation of the tool point per unit force and moment on it, in poses of shape (..., N, 3), m.

    Symmetric, shape (..., 6, 6), m/N, rad/N, m/(N·m) and rad/(N·m), in frame G.

    Raises:
        TrussError: The truss is a mechanism at one of the poses.
    """
    n = np.asarray(nodes, float)
    flat = n.reshape(-1, *n.shape[-2:])
    load, to_centroid = np.zeros((len(flat), pattern_of(model.truss).size, 6)), _tool_to_centroid(model, flat)
    load[:, -6:] = to_centroid
    moved, _ = _solve(model, flat, load)
    return (np.swapaxes(to_centroid, 1, 2) @ moved[:, -6:]).reshape(*n.shape[:-2], 6, 6)


def node_loads(model: ElasticModel, nodes: Array, motion: NodeMotion | None = None) -> Array:
    """Weight, and inertia in a motion, of everything: shape (..., N, 3), N, for nodes of shape (..., N, 3)."""
    force = hub_loads(model.loads, nodes, motion) + member_loads(model.loads, nodes, motion).total
    return force + block_loads(model.loads, nodes, motion).total if len(model.truss.rings) else force


def gather(truss: Truss, nodes: Array, force: Array) -> Array:
    """Forces at the nodes, shape (T, N, 3), as loads on the unknowns, shape (T, n)."""
    if len(truss.rings):
        force, middle = force.copy(), truss.rings[:, :, 1]
        force[:, middle] += ring_loads(truss, nodes, force)
    free, tip = force[:, truss.free].reshape(len(force), -1), force[:, truss.tip]
    moment = np.cross(_levers(truss, nodes), tip).sum(axis=1)
    return np.concatenate([free, tip.sum(axis=1), moment], axis=-1)


def scatter(truss: Truss, nodes: Array, moved: Array) -> Array:
    """Unknowns, shape (T, n), as displacements of the nodes, shape (T, N, 3)."""
    shift = np.zeros(nodes.shape)
    shift[:, truss.free] = moved[:, :-6].reshape(len(moved), -1, 3)
    if len(truss.rings):
        middle = shift[:, truss.rings[:, :, 1]].reshape(len(shift), len(truss.rings), 9)
        ends = np.einsum("trbeik,trk->trbei", block_moves(truss, nodes), middle)
        shift[:, truss.rings[:, :, [0, 2]]] = ends
    shift[:, truss.tip] = moved[:, None, -6:-3] + cross(moved[:, None, -3:], _levers(truss, nodes))
    return shift


def _levers(truss: Truss, nodes: Array) -> Array:
    """Tip nodes from their centroid, shape (T, 3, 3), m."""
    return nodes[:, truss.tip] - nodes[:, truss.tip].mean(axis=1, keepdims=True)


def band_matrix(model: ElasticModel, nodes: Array, spring: Array | None = None) -> Stiffness:
    """Stiffness matrices of poses of shape (T, N, 3), m, by stiffnesses of shape (T, M), N/m; absent, those of the pose."""
    spring = model.stiffness_at(nodes) if spring is None else spring
    return assemble(pattern_of(model.truss), elongations(model.truss, nodes), spring)


def _solve(model: ElasticModel, nodes: Array, load: Array) -> tuple[Array, Array]:
    """Unknowns, shape (T, n, R), and bar forces, shape (T, M, R), of loads, shape (T, n, R)."""
    moved, numbers = np.empty(load.shape), np.arange(len(nodes))
    bar = np.empty((len(nodes), len(model.truss.members), load.shape[-1]))
    for start in range(0, len(nodes), _CHUNK):
        part = slice(start, start + _CHUNK)
        matrices = band_matrix(model, nodes[part])
        moved[part] = solve_poses(model.truss, nodes[part], matrices, load[part], numbers[part])
        bar[part] = matrices.bar(moved[part])
    return moved, bar


def _tool_to_centroid(model: ElasticModel, nodes: Array) -> Array:
    """Matrices from wrenches about the tool point to those about the tip's centroid, shape (T, 6, 6).

    Their transposes take motions of the centroid to those of the tool point.
    """
    lever = tool_point(model.loads, nodes) - nodes[:, model.truss.tip].mean(axis=1)
    matrix = np.tile(np.eye(6), (len(nodes), 1, 1))
    matrix[:, 3:, :3] = np.cross(lever[:, :, None], np.eye(3)[None], axis=1)
    return matrix
