"""Where an elastic arm comes to rest: equilibrium at the deformed pose, not only to first order."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import TrussError
from vgtsim.statics.banded_solve import solve_poses
from vgtsim.statics.blocks import find_heights, seat_blocks
from vgtsim.statics.elasticity import ElasticModel
from vgtsim.statics.motion import NodeMotion
from vgtsim.statics.stiffness import band_matrix, elongations, gather, node_loads, pattern_of, scatter

Array = NDArray[np.float64]

_CHUNK = 256  # poses settled at a time: keeps the work arrays in cache
_PASSES = 40  # Newton doubles the digits: a posture that needs more has no rest
_CLOSE = 1e-11  # last correction of a node at which the passes end, m


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
    load = gather(model.truss, nodes, node_loads(model, nodes, motion) + more)
    pulls = bar[..., None] * elongations(model.truss, nodes)
    width = pattern.size + 1  # what acts on fixed nodes lands in a column of its own
    place = np.where(pattern.dof < 0, pattern.size, pattern.dof) + width * np.arange(len(nodes))[:, None, None]
    carried = np.bincount(place.ravel(), pulls.ravel(), width * len(nodes)).reshape(len(nodes), width)
    return load - carried[:, :-1]


def _correct(
    model: ElasticModel, nodes: Array, spring: Array, load: Array, numbers: NDArray[np.intp]
) -> tuple[Array, Array]:
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
