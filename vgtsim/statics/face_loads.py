"""Forces at the three hubs of a face that stand for a wrench: weight and inertia of plate and payload, tool, hose; compiled.

`figures` are side b of the plate and distance of the tool point from it, m; masses of plate and payload, kg; and integrals of
x², y² and z² over both about their own centres, kg·m². Nodes have shape (T, N, 3), m, the corners of the plate last.
"""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.compilation import compiled
from vgtsim.kinematics import cross_into


@compiled
def place_tool(figures: Array, nodes: Array, point: Array) -> None:
    """Tool points, shape (T, 3), m."""
    axes, tip = np.empty((3, 3)), _find_tip(nodes.shape[1])
    for t in range(len(nodes)):
        _set_axes(nodes[t], tip, figures[0], axes)
        for k in range(3):
            centroid = (nodes[t, tip[0], k] + nodes[t, tip[1], k] + nodes[t, tip[2], k]) / 3
            point[t, k] = centroid + figures[1] * axes[2, k]


@compiled
def push_tool(figures: Array, nodes: Array, wrench: Array, total: Array) -> None:
    """Add least forces at the nodes that make up wrenches on the tool point, shape (T, 6), N and N·m."""
    axes, arm, moment, tip = np.empty((3, 3)), np.empty(3), np.empty(3), _find_tip(nodes.shape[1])
    for t in range(len(nodes)):
        _set_axes(nodes[t], tip, figures[0], axes)
        cross_into(axes[2], wrench[t, :3], arm)
        for k in range(3):
            moment[k] = wrench[t, 3 + k] + figures[1] * arm[k]
        _spread(wrench[t, :3], moment, tip, axes, figures[0], total[t])


@compiled
def bend_faces(faces: Index, side: float, nodes: Array, couples: Array, total: Array) -> None:
    """Add least forces at the corners of faces, shape (F, 3), that make up couples, shape (T, F, 3), N·m."""
    axes, nothing = np.empty((3, 3)), np.zeros(3)
    for t in range(len(nodes)):
        for f in range(len(faces)):
            _set_axes(nodes[t], faces[f], side, axes)
            _spread(nothing, couples[t, f], faces[f], axes, side, total[t])


@compiled
def load_hubs(
    figures: Array, hubs: Array, gravity: Array, nodes: Array, velocity: Array, acceleration: Array, total: Array
) -> None:
    """Weight and inertia of hubs of masses (N,), kg, of plate and payload, shape (T, N, 3), N; no velocities at rest."""
    offset, plate, payload, tip = figures[1], figures[2], figures[3], _find_tip(nodes.shape[1])
    axes, tool, force, moment = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(3)
    change, arm = np.zeros((3, 3)), np.empty(3)
    for t in range(len(nodes)):
        for i in range(nodes.shape[1]):
            for k in range(3):
                total[t, i, k] = hubs[i] * (gravity[k] - (acceleration[t, i, k] if len(velocity) else 0.0))
        _set_axes(nodes[t], tip, figures[0], axes)
        if len(velocity):
            _find_change(axes, velocity[t], acceleration[t], tip, figures[0], change)
        for k in range(3):
            centre = gravity[k]
            if len(velocity):
                centre -= (acceleration[t, tip[0], k] + acceleration[t, tip[1], k] + acceleration[t, tip[2], k]) / 3
            tool[k] = payload * (centre - offset * change[2, k])
            force[k] = plate * centre + tool[k]
        cross_into(axes[2], tool, moment)
        for k in range(3):
            moment[k] *= offset
        if len(velocity):
            for a in range(3):
                cross_into(axes[a], change[a], arm)
                for k in range(3):
                    moment[k] -= figures[4 + a] * arm[k]
        _spread(force, moment, tip, axes, figures[0], total[t])


@compiled
def _find_change(axes: Array, velocity: Array, acceleration: Array, corners: Index, side: float, change: Array) -> None:
    """Second time derivatives of the axes, shape (3, 3), by rows, from the motion of the nodes, shape (N, 3)."""
    turning, part = np.empty((2, 3)), np.empty((3, 3))
    _lean(velocity, corners, side, turning)
    _lean(acceleration, corners, side, change)
    cross_into(turning[0], turning[1], part[0])
    cross_into(change[0], axes[1], part[1])
    cross_into(axes[0], change[1], part[2])
    for k in range(3):
        change[2, k] = 2 * part[0, k] + part[1, k] + part[2, k]


@compiled
def _spread(force: Array, moment: Array, corners: Index, axes: Array, side: float, total: Array) -> None:
    """Add least forces at the corners of a triangle that make up a force and a moment about its centroid."""
    lever, corner, arm, along = np.empty(3), np.empty(3), np.empty(3), 0.0
    low, high = side / (2 * np.sqrt(3)), side / np.sqrt(3)  # distances of a side and of a corner from the centroid
    for k in range(3):
        along += moment[k] * axes[2, k]
    for k in range(3):
        lever[k] = (2 * moment[k] - along * axes[2, k]) / side**2
    for c in range(3):
        x, y = (1 - c) * side / 2, high if c == 1 else -low
        for k in range(3):
            corner[k] = x * axes[0, k] + y * axes[1, k]
        cross_into(lever, corner, arm)
        for k in range(3):
            total[corners[c], k] += force[k] / 3 + arm[k]


@compiled
def _set_axes(nodes: Array, corners: Index, side: float, axes: Array) -> None:
    """X, Y and Z axes of a face, shape (3, 3), by rows."""
    _lean(nodes, corners, side, axes)
    cross_into(axes[0], axes[1], axes[2])


@compiled
def _lean(nodes: Array, corners: Index, side: float, axes: Array) -> None:
    """X and Y axes of a face from its corners, or derivatives of both, into two rows."""
    for k in range(3):
        one, two, three = nodes[corners[0], k], nodes[corners[1], k], nodes[corners[2], k]
        axes[0, k] = (one - three) / side
        axes[1, k] = (2 * two - one - three) / (np.sqrt(3) * side)


@compiled
def _find_tip(count: int) -> Index:
    """The last three of some nodes."""
    tip = np.empty(3, np.intp)
    for c in range(3):
        tip[c] = count - 3 + c
    return tip
