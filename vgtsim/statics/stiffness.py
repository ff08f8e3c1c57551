"""Direct stiffness of a whole arm: displacements, member forces and tip compliance over any batch of poses.

Unknowns are the displacements of the free hubs and, for the rigid tip plate with tool and payload, a displacement of its
centroid and a rotation about it. Nodes are numbered from the mast to the tip, so the stiffness matrix is narrow.

Of joint blocks the middles have unknowns; feet and heads follow them, see `blocks`. An elastic arm comes to rest in equilibrium
at the deformed pose, not only to first order: `settle`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index
from vgtsim.errors import TrussError
from vgtsim.kinematics import Truss, cross
from vgtsim.statics.blocks import block_moves, find_heights, ring_loads, seat_blocks
from vgtsim.statics.elasticity import ElasticModel
from vgtsim.statics.loads import block_loads, hub_loads, member_loads, tool_point
from vgtsim.statics.motion import NodeMotion
from vgtsim.statics.stiffness_matrix import Pattern, Stiffness, assemble, make_pattern, solve_poses

_CHUNK = 256  # poses assembled or settled at a time: keeps the work arrays in cache
_PASSES = 40  # Newton doubles the digits: a posture that needs more has no rest
_CLOSE = 1e-11  # last correction of a node at which the passes end, m


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
def _seated(truss: Truss, side: int) -> tuple[Index, tuple[Index, Index, Index]]:
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
    model: ElasticModel, nodes: ArrayLike, tool_wrench: ArrayLike | None = None, *, weight: bool = True
) -> Deflection:
    """Find displacements and member forces under weight and a load on the tool, linear about an unloaded pose (..., N, 3), m.

    A force on the tool point and a moment about it are broadcast to shape (..., 6), N and N·m, in frame G. `weight` says
    whether gravity acts.

    Raises:
        TrussError: The truss is a mechanism at one of the poses; members are named.

    Source: direct stiffness method, for example W. McGuire, R. H. Gallagher and R. D. Ziemian, Matrix Structural
        Analysis, second edition (2000), chapter 3.
    """
    n = np.asarray(nodes, float)
    batch, flat = n.shape[:-2], n.reshape(-1, *n.shape[-2:])
    force = node_loads(model, flat) if weight else np.zeros(flat.shape)
    load, to_centroid = gather_load(model.truss, flat, force), _tool_to_centroid(model, flat)
    if tool_wrench is not None:
        load[:, -6:] += np.einsum("tij,tj->ti", to_centroid, np.broadcast_to(tool_wrench, (*batch, 6)).reshape(-1, 6))
    moved, bar = _solve(model, flat, load[..., None])
    shift = scatter(model.truss, flat, moved[..., 0])
    tool = np.einsum("tji,tj->ti", to_centroid, moved[:, -6:, 0])
    return Deflection(shift.reshape(n.shape), tool.reshape(*batch, 6), bar[..., 0].reshape(*batch, bar.shape[1]))


def tip_compliance(model: ElasticModel, nodes: ArrayLike) -> Array:
    """Displacement and rotation of the tool point per unit force and moment on it, in poses of shape (..., N, 3), m.

    Symmetric, shape (..., 6, 6), m/N, rad/N, m/(N·m) and rad/(N·m), in frame G. Errors are those of `deflect`.
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


def gather_load(truss: Truss, nodes: Array, force: Array) -> Array:
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


def settle(
    model: ElasticModel,
    nodes: ArrayLike,
    motion: NodeMotion | None = None,
    damping_time: float = 0.0,
    nodal_forces: ArrayLike | None = None,
) -> Array:
    """Loaded pose, in which every member's force is its stiffness times its elongation, for an unloaded pose (..., N, 3), m.

    In a motion, its inertia and damping act too; `damping_time` is damper over stiffness of every member, s. Further forces
    on the hubs are broadcast to shape (..., N, 3), N.

    Raises:
        TrussError: The arm buckles as a whole: the passes do not end. Or it is a mechanism; members are named.

    Source: Newton's method on the residual forces, without the geometric part of the tangent.
    """
    n = np.asarray(nodes, float)
    flat, moving = n.reshape(-1, *n.shape[-2:]), None if motion is None else motion.flat
    settled, more = np.empty(flat.shape), np.broadcast_to(0.0 if nodal_forces is None else nodal_forces, n.shape)
    more = more.reshape(flat.shape)
    for start in range(0, len(flat), _CHUNK):
        part = slice(start, start + _CHUNK)
        settled[part] = _settle_chunk(model, flat[part], moving and moving.at(part), damping_time, more[part], start)
    return settled.reshape(n.shape)


def _settle_chunk(
    model: ElasticModel, unloaded: Array, motion: NodeMotion | None, damping_time: float, more: Array, start: int
) -> Array:
    """As `settle`, for poses of shape (T, N, 3), `start` of all; those that have settled are left alone."""
    truss = model.truss
    rest, spring = truss.lengths(unloaded), model.stiffness_at(unloaded)
    nodes, left, step = unloaded.copy(), np.arange(len(unloaded)), 0.0
    for _ in range(_PASSES):
        pose, now = nodes[left], motion and motion.at(left)
        bar = spring[left] * (truss.lengths(pose) - rest[left])
        if now is not None:
            span = truss.spans(pose)
            stretching = np.sum(span * truss.spans(now.velocity), axis=-1) / np.linalg.norm(span, axis=-1)
            bar = bar + damping_time * spring[left] * stretching
        nodes[left], shift = _correct(
            model, pose, spring[left], _residual(model, pose, bar, now, more[left]), start + left
        )
        step = np.abs(shift).max(axis=(1, 2))
        left = left[~(step < _CLOSE)]  # NaN has not settled
        if not len(left):
            return nodes
    raise TrussError(pattern_of(truss).size, (), f"does not settle: {np.max(step):.3g} m in pass {_PASSES}")


def _residual(model: ElasticModel, nodes: Array, bar: Array, motion: NodeMotion | None, more: Array) -> Array:
    """Loads on the unknowns that member forces, shape (T, M), do not yet carry, shape (T, n), N and N·m."""
    pattern = pattern_of(model.truss)
    load = gather_load(model.truss, nodes, node_loads(model, nodes, motion) + more)
    pulls = bar[..., None] * elongations(model.truss, nodes)
    width = pattern.size + 1  # what acts on fixed nodes lands in a column of its own
    place = np.where(pattern.dof < 0, pattern.size, pattern.dof) + width * np.arange(len(nodes))[:, None, None]
    carried = np.bincount(place.ravel(), pulls.ravel(), width * len(nodes)).reshape(len(nodes), width)
    return load - carried[:, :-1]


def _correct(model: ElasticModel, nodes: Array, spring: Array, load: Array, numbers: Index) -> tuple[Array, Array]:
    """Nodes after a step of Newton's method, shape (T, N, 3), and how far they moved; the plate turns without growing."""
    from scipy.spatial.transform import Rotation  # slow to load, and only an elastic arm needs it

    truss = model.truss
    moved = solve_poses(truss, nodes, band_matrix(model, nodes, spring), load[..., None], numbers)[..., 0]
    shift = scatter(truss, nodes, moved)
    centre = nodes[:, truss.tip].mean(axis=1, keepdims=True)
    turn = np.swapaxes(Rotation.from_rotvec(moved[:, -3:]).as_matrix(), 1, 2)
    after = nodes + shift
    if len(truss.rings):
        seat_blocks(truss, after, find_heights(truss, nodes))
    after[:, truss.tip] = centre + moved[:, None, -6:-3] + (nodes[:, truss.tip] - centre) @ turn
    return after, shift
