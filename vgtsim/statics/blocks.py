"""Joint blocks of an elastic arm: how feet and heads follow the middles of their ring.

Blocks are rigid, and so are actuators in bending. An actuator stays square to both of its blocks, so the three blocks of a
ring stay on the normals of the plane through their middles: the middles' nine displacements say how all of it moves.
"""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array
from vgtsim.kinematics import Truss, cross

_ENDS = [0, 2]  # foot and head among the nodes of a block
_STEP = 1e-5  # m, of the central differences: at the least both of their errors, a relative 1e-10


def find_heights(truss: Truss, nodes: Array) -> Array:
    """Heights of feet and heads over the plane of the middles, shape (..., R, 3, 2), m, for nodes of shape (..., N, 3)."""
    normal = _normals(nodes[..., truss.rings[:, :, 1], :])[0]
    return np.einsum("...rbei,...ri->...rbe", _arms(truss, nodes), normal)


def seat_blocks(truss: Truss, nodes: Array, heights: Array) -> None:
    """Put feet and heads at heights over the planes of their middles: writes them into nodes, shape (..., N, 3)."""
    middle = nodes[..., truss.rings[:, :, 1], :]
    normal = _normals(middle)[0]
    nodes[..., truss.rings[:, :, _ENDS], :] = middle[..., None, :] + heights[..., None] * normal[..., None, None, :]


def block_moves(truss: Truss, nodes: Array) -> Array:
    """Displacements of feet and heads per displacement of the middles of their ring, for nodes of shape (..., N, 3), m.

    Shape (..., R, 3, 2, 3, 9): rings, blocks, foot and head, axes, and the middles one after the other.
    """
    middle = nodes[..., truss.rings[:, :, 1], :]
    normal, twice = _normals(middle)
    # a middle that leaves the plane turns the normal away by the gradient of that middle's barycentric coordinate
    opposite = middle[..., [2, 0, 1], :] - middle[..., [1, 2, 0], :]
    gradient = cross(normal[..., None, :], opposite) / twice[..., None, None]
    turn = -gradient[..., None] * normal[..., None, None, :]  # by middle, axis of the normal, axis of the middle
    turn = np.swapaxes(turn, -3, -2).reshape(*twice.shape, 3, 9)
    moves = find_heights(truss, nodes)[..., None, None] * turn[..., None, None, :, :]
    for block in range(3):
        moves[..., block, :, :, 3 * block : 3 * block + 3] += np.eye(3)
    return moves


def ring_loads(truss: Truss, nodes: Array, force: Array) -> Array:
    """Forces on feet and heads as loads on the middles, shape (..., R, 3, 3), N, for nodes and forces of shape (..., N, 3)."""
    moves, pull = block_moves(truss, nodes), force[..., truss.rings[:, :, _ENDS], :]
    load = np.einsum("...rbeik,...rbei->...rk", moves, pull)
    return load.reshape(*load.shape[:-1], 3, 3)


def ring_stiffness(truss: Truss, nodes: Array, force: Array) -> Array:
    """Stiffness that forces of fixed direction on feet and heads add, symmetric, shape (R, 9, 9), N/m; nodes (N, 3), m.

    As the middles move, feet and heads turn about them: minus the derivative of `ring_loads`, by central differences.
    """
    heights, middles = find_heights(truss, nodes), truss.rings[:, :, 1]
    found = np.empty((len(truss.rings), 9, 9))
    for column in range(9):
        loads = []
        for step in (_STEP, -_STEP):
            moved = nodes.copy()
            moved[middles[:, column // 3], column % 3] += step
            seat_blocks(truss, moved, heights)
            loads.append(ring_loads(truss, moved, force).reshape(-1, 9))
        found[:, :, column] = -(loads[0] - loads[1]) / (2 * _STEP)
    return (found + np.swapaxes(found, 1, 2)) / 2


def _normals(middle: Array) -> tuple[Array, Array]:
    """Unit normals of triangles of shape (..., 3, 3), and twice their areas."""
    area = cross(middle[..., 1, :] - middle[..., 0, :], middle[..., 2, :] - middle[..., 0, :])
    twice = np.linalg.norm(area, axis=-1)
    return area / twice[..., None], twice


def _arms(truss: Truss, nodes: Array) -> Array:
    """Feet and heads from the middles of their blocks, shape (..., R, 3, 2, 3), m."""
    return nodes[..., truss.rings[:, :, _ENDS], :] - nodes[..., truss.rings[:, :, 1], None, :]
