"""Where an elastic arm comes to rest: equilibrium at the deformed pose, not only to first order."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from vgtsim.errors import TrussError
from vgtsim.statics.band import solve_band
from vgtsim.statics.elasticity import ElasticModel
from vgtsim.statics.motion import Motion
from vgtsim.statics.stiffness import band_matrix, elongations, gather, node_loads, pattern_of, scatter

Array = NDArray[np.float64]

_PASSES = 40
_CLOSE = 1e-11  # last correction of a node at which the passes end, m


def settle(model: ElasticModel, nodes: ArrayLike, motion: Motion | None = None, damping_time: float = 0.0) -> Array:
    """Find the pose in which every member's force is its stiffness times its elongation.

    Args:
        model: Masses and stiffnesses.
        nodes: Unloaded pose, shape (..., N, 3), m, in frame G.
        motion: Velocities and accelerations of the nodes, whose inertia and damping act too; absent at rest.
        damping_time: Damper over stiffness of every member, s.

    Returns:
        Loaded pose, shape (..., N, 3), m.

    Raises:
        TrussError: The arm buckles as a whole, or is a mechanism: the passes do not end.

    Source: Newton's method on the residual forces, without the geometric part of the tangent.
    """
    n = np.asarray(nodes, float)
    flat = n.reshape(-1, *n.shape[-2:])
    settled = np.empty(flat.shape)
    for index, pose in enumerate(flat):
        now = None
        if motion is not None:
            parts = (part.reshape(flat.shape)[index : index + 1] for part in (motion.velocity, motion.acceleration))
            now = Motion(*parts)
        settled[index] = _settle_one(model, pose[None], now, damping_time)[0]
    return settled.reshape(n.shape)


def _settle_one(model: ElasticModel, unloaded: Array, motion: Motion | None, damping_time: float) -> Array:
    """As `settle`, for one pose of shape (1, N, 3)."""
    truss, pattern = model.truss, pattern_of(model.truss)
    rest, spring = _lengths(model, unloaded), model.stiffness_at(unloaded)
    nodes, shift = unloaded.copy(), np.full(unloaded.shape, np.inf)
    for _ in range(_PASSES):
        bar = spring * (_lengths(model, nodes) - rest)
        if motion is not None:
            bar = bar + damping_time * spring * _stretching(model, nodes, motion.velocity)
        load = gather(truss, nodes, node_loads(model, nodes, motion))[0]
        pulls = bar[0, :, None] * elongations(truss, nodes)[0]
        load -= np.bincount(np.where(pattern.dof < 0, pattern.size, pattern.dof).ravel(), pulls.ravel())[:-1]
        moved = solve_band(truss, nodes[0], band_matrix(model, nodes, spring)[0][0], load)
        shift = scatter(truss, nodes, moved[None])
        centre = nodes[:, truss.tip].mean(axis=1, keepdims=True)
        turned = (nodes[0, truss.tip] - centre[0]) @ Rotation.from_rotvec(moved[-3:]).as_matrix().T
        tip = centre + moved[-6:-3] + turned
        nodes = nodes + shift
        nodes[:, truss.tip] = tip  # the plate turns without growing
        if np.abs(shift).max() < _CLOSE:
            return nodes
    raise TrussError(pattern.size, (), f"does not settle: {np.abs(shift).max():.3g} m in pass {_PASSES}")


def _stretching(model: ElasticModel, nodes: Array, velocity: Array) -> Array:
    """Rates of the members' lengths, shape (1, M), m/s."""
    first, second = model.truss.ends.T
    span, rate = nodes[:, second] - nodes[:, first], velocity[:, second] - velocity[:, first]
    return np.sum(span * rate, axis=-1) / np.linalg.norm(span, axis=-1)


def _lengths(model: ElasticModel, nodes: Array) -> Array:
    ends = model.truss.ends
    return np.linalg.norm(nodes[:, ends[:, 1]] - nodes[:, ends[:, 0]], axis=-1)
