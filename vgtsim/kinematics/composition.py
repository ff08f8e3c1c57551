"""Modules joined to a chain, compiled: bases and tops, velocities, nodes, and what legs say about all inputs."""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.compilation import compiled
from vgtsim.geometry import copy_matrix
from vgtsim.kinematics.conditioning import invert_in_place


@compiled
def compose(
    root: Array,
    steps: Array,
    owner: Index,
    frame: Array,
    motion: Array,
    base: Array,
    top: Array,
    angular: Array,
    linear: Array,
) -> None:
    """Bases and tops of modules, and velocities of what is beyond them, see `State`.

    Args:
        root: Base of the first module in G, shape (3, 4), m.
        steps: From the base of the next module to the top of each, shape (A, 3, 4), m.
        owner: Module of each input, shape (n,).
        frame: R_BT beside P_BT of each module, shape (b, A, 3, 4), m.
        motion: Angular velocity and velocity of the top in frame B, shape (b, n, 6); empty where not asked for.
    """
    spin, slide = np.empty(3), np.empty(3)
    for i in range(len(frame)):
        copy_matrix(root, base[i, 0])
        for a in range(frame.shape[1]):
            _join(base[i, a], frame[i, a], top[i, a])
            _join(top[i, a], steps[a], base[i, a + 1])
        for j in range(motion.shape[1]):
            R, T = base[i, owner[j]], top[i, owner[j]]
            for k in range(3):
                spin[k] = R[k, 0] * motion[i, j, 0] + R[k, 1] * motion[i, j, 1] + R[k, 2] * motion[i, j, 2]
                slide[k] = R[k, 0] * motion[i, j, 3] + R[k, 1] * motion[i, j, 4] + R[k, 2] * motion[i, j, 5]
                angular[i, j, k] = spin[k]
            linear[i, j, 0] = slide[0] - spin[1] * T[2, 3] + spin[2] * T[1, 3]
            linear[i, j, 1] = slide[1] - spin[2] * T[0, 3] + spin[0] * T[2, 3]
            linear[i, j, 2] = slide[2] - spin[0] * T[1, 3] + spin[1] * T[0, 3]


@compiled
def _join(first: Array, second: Array, both: Array) -> None:
    """Product of two transforms, rotation beside origin, shape (3, 4)."""
    for k in range(3):
        x, y, z = first[k, 0], first[k, 1], first[k, 2]
        for j in range(4):
            both[k, j] = x * second[0, j] + y * second[1, j] + z * second[2, j]
        both[k, 3] += first[k, 3]


@compiled
def seat_corners(flange: Array, face_from: Index, corners: Index, spots: Array, top: Array, nodes: Array) -> None:
    """Nodes on faces, see `Layout`; the flange is the mount, shape (3, 4), m."""
    for i in range(len(nodes)):
        for c in range(len(corners)):
            source = face_from[corners[c, 1]]
            T = top[i, source - 1] if source else flange
            for k in range(3):
                along = T[k, 0] * spots[c, 0] + T[k, 1] * spots[c, 1] + T[k, 2] * spots[c, 2]
                nodes[i, corners[c, 0], k] = along + T[k, 3]


@compiled
def seat_inner(base: Array, active: Index, index: Index, inner: Array, nodes: Array) -> None:
    """Nodes on neither face, of a place's modules."""
    for i in range(len(nodes)):
        for m in range(len(active)):
            T = base[i, active[m]]
            for c in range(index.shape[1]):
                for k in range(3):
                    along = T[k, 0] * inner[i, m, c, 0] + T[k, 1] * inner[i, m, c, 1] + T[k, 2] * inner[i, m, c, 2]
                    nodes[i, index[m, c], k] = along + T[k, 3]


@compiled
def move_body(point: Array, angular: Array, linear: Array, J: Array) -> None:
    """Velocity of a body's point, shape (b, 3), m, over angular velocity, per input, shape (b, 6, n)."""
    for i in range(len(J)):
        x, y, z = point[i, 0], point[i, 1], point[i, 2]
        for j in range(J.shape[2]):
            p, q, r = angular[i, j, 0], angular[i, j, 1], angular[i, j, 2]
            J[i, 0, j] = linear[i, j, 0] + q * z - r * y
            J[i, 1, j] = linear[i, j, 1] + r * x - p * z
            J[i, 2, j] = linear[i, j, 2] + p * y - q * x
            J[i, 3, j], J[i, 4, j], J[i, 5, j] = p, q, r


@compiled
def move_nodes(points: Array, moves: Index, angular: Array, linear: Array, J: Array) -> None:
    """Velocities of points, shape (b, N, 3), m, per input, shape (b, N, 3, n), that only their first inputs move."""
    for i in range(len(J)):
        for c in range(J.shape[1]):
            x, y, z = points[i, c, 0], points[i, c, 1], points[i, c, 2]
            for j in range(moves[c]):
                p, q, r = angular[i, j, 0], angular[i, j, 1], angular[i, j, 2]
                J[i, c, 0, j] = linear[i, j, 0] + q * z - r * y
                J[i, c, 1, j] = linear[i, j, 1] + r * x - p * z
                J[i, c, 2, j] = linear[i, j, 2] + p * y - q * x
            for k in range(3):
                for j in range(moves[c], J.shape[3]):
                    J[i, c, k, j] = 0.0


@compiled
def move_inner(base: Array, active: Index, index: Index, columns: Index, slope: Array, J: Array) -> None:
    """Velocities of the nodes on neither face by the inputs of their own module, into the array of `move_nodes`."""
    for i in range(len(J)):
        for m in range(len(active)):
            T = base[i, active[m]]
            for c in range(index.shape[1]):
                for j in range(columns.shape[1]):
                    x, y, z = slope[i, m, c, 0, j], slope[i, m, c, 1, j], slope[i, m, c, 2, j]
                    for k in range(3):
                        J[i, index[m, c], k, columns[m, j]] = T[k, 0] * x + T[k, 1] * y + T[k, 2] * z


@compiled
def pull(weight: Array, legs: Index, columns: Index, block: Array, row: Array) -> None:
    """Slope by a place's inputs of its legs with weights, shape (b, J) or (b, J + S); legs without a weight are left out."""
    for i in range(len(block)):
        for m in range(block.shape[1]):
            for j in range(block.shape[3]):
                total = 0.0
                for leg in range(block.shape[2]):
                    if legs[m, leg] < weight.shape[1]:
                        total += weight[i, legs[m, leg]] * block[i, m, leg, j]
                row[i, columns[m, j]] = total


@compiled
def curve(weight: Array, legs: Index, columns: Index, block: Array, whole: Array) -> None:
    """The squares of the legs' slopes with weights, as `pull`, into a matrix of all inputs, shape (b, n, n)."""
    for i in range(len(block)):
        for m in range(block.shape[1]):
            for j in range(block.shape[3]):
                for k in range(block.shape[3]):
                    total = 0.0
                    for leg in range(block.shape[2]):
                        if legs[m, leg] < weight.shape[1]:
                            total += block[i, m, leg, j] * weight[i, legs[m, leg]] * block[i, m, leg, k]
                    whole[i, columns[m, j], columns[m, k]] = total


@compiled
def spread(legs: Index, columns: Index, block: Array, whole: Array) -> None:
    """Slopes of a place's legs into a matrix of all legs and all inputs, shape (b, J + S, n)."""
    for i in range(len(block)):
        for m in range(block.shape[1]):
            for leg in range(block.shape[2]):
                for j in range(block.shape[3]):
                    whole[i, legs[m, leg], columns[m, j]] = block[i, m, leg, j]


@compiled
def spread_rates(lengths: Index, columns: Index, block: Array, whole: Array) -> None:
    """Rates of all inputs by all actuators, (b, n, J), of those of a place's inputs by its legs, (b, M, inputs, legs)."""
    for b in range(len(block)):
        for m in range(block.shape[1]):
            for leg in range(block.shape[3]):
                if lengths[m, leg] >= 0:
                    for i in range(block.shape[2]):
                        whole[b, columns[m, i], lengths[m, leg]] = block[b, m, i, leg]


@compiled
def correct(legs: Index, columns: Index, block: Array, off: Array, change: Array) -> bool:
    """Fill in the change of a place's inputs that makes its legs longer, (J + S,), m, to first order; whether there is one."""
    count = block.shape[3]
    inverse, rows = np.empty((count, count)), np.empty(count, np.intp)
    for m in range(block.shape[1]):
        for i in range(count):
            for j in range(count):
                inverse[i, j] = block[0, m, i, j]
        if not invert_in_place(inverse, rows, count):
            return False
        for j in range(count):
            total = 0.0
            for leg in range(count):
                total += inverse[j, leg] * off[legs[m, leg]]
            change[columns[m, j]] = total
    return True
