"""Forces at the three hubs of the tip plate that stand for weight, inertia and wrenches of plate, payload and tool; compiled.

`figures` are side b of the plate and distance of the tool point from it, m; masses of plate and payload, kg; and integrals of
x², y² and z² over both about their own centres, kg·m². Nodes have shape (T, N, 3), m, the corners of the plate last.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.compilation import compiled
from vgtsim.kinematics.vectors import cross_into

Array = NDArray[np.float64]


@compiled
def place_tool(figures: Array, nodes: Array, point: Array) -> None:
    """Tool points, shape (T, 3), m."""
    axes, first = np.empty((3, 3)), nodes.shape[1] - 3
    for t in range(len(nodes)):
        _set_axes(nodes[t], figures[0], axes)
        for k in range(3):
            centroid = (nodes[t, first, k] + nodes[t, first + 1, k] + nodes[t, first + 2, k]) / 3
            point[t, k] = centroid + figures[1] * axes[2, k]


@compiled
def push_tool(figures: Array, nodes: Array, wrench: Array, total: Array) -> None:
    """Add least forces at the nodes that make up wrenches on the tool point, shape (T, 6), N and N·m."""
    axes, arm, moment = np.empty((3, 3)), np.empty(3), np.empty(3)
    for t in range(len(nodes)):
        _set_axes(nodes[t], figures[0], axes)
        cross_into(axes[2], wrench[t, :3], arm)
        for k in range(3):
            moment[k] = wrench[t, 3 + k] + figures[1] * arm[k]
        _spread(wrench[t, :3], moment, axes, figures[0], total[t])


@compiled
def load_hubs(
    figures: Array, hubs: Array, gravity: Array, nodes: Array, velocity: Array, acceleration: Array, total: Array
) -> None:
    """Weight and inertia of hubs of masses (N,), kg, of plate and payload, shape (T, N, 3), N; no velocities at rest."""
    offset, plate, payload, first = figures[1], figures[2], figures[3], nodes.shape[1] - 3
    axes, tool, force, moment = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(3)
    change, arm = np.zeros((3, 3)), np.empty(3)
    for t in range(len(nodes)):
        for i in range(nodes.shape[1]):
            for k in range(3):
                total[t, i, k] = hubs[i] * (gravity[k] - (acceleration[t, i, k] if len(velocity) else 0.0))
        _set_axes(nodes[t], figures[0], axes)
        if len(velocity):
            _find_change(axes, velocity[t], acceleration[t], figures[0], change)
        for k in range(3):
            centre = gravity[k]
            if len(velocity):
                centre -= (
                    acceleration[t, first, k] + acceleration[t, first + 1, k] + acceleration[t, first + 2, k]
                ) / 3
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
        _spread(force, moment, axes, figures[0], total[t])


@compiled
def _find_change(axes: Array, velocity: Array, acceleration: Array, side: float, change: Array) -> None:
    """Second time derivatives of the axes, shape (3, 3), by rows, from the motion of the nodes, shape (N, 3)."""
    turning, part = np.empty((2, 3)), np.empty(3)
    _lean(velocity, side, turning)
    _lean(acceleration, side, change)
    cross_into(turning[0], turning[1], change[2])
    for k in range(3):
        change[2, k] *= 2
    cross_into(change[0], axes[1], part)
    for k in range(3):
        change[2, k] += part[k]
    cross_into(axes[0], change[1], part)
    for k in range(3):
        change[2, k] += part[k]


@compiled
def _spread(force: Array, moment: Array, axes: Array, side: float, total: Array) -> None:
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
            total[len(total) - 3 + c, k] += force[k] / 3 + arm[k]


@compiled
def _set_axes(nodes: Array, side: float, axes: Array) -> None:
    """X, Y and Z axes of the tip plate, shape (3, 3), by rows."""
    _lean(nodes, side, axes)
    cross_into(axes[0], axes[1], axes[2])


@compiled
def _lean(nodes: Array, side: float, axes: Array) -> None:
    """X and Y axes of the tip plate from its corners, or derivatives of both, into two rows."""
    first = len(nodes) - 3
    for k in range(3):
        one, two, three = nodes[first, k], nodes[first + 1, k], nodes[first + 2, k]
        axes[0, k] = (one - three) / side
        axes[1, k] = (2 * two - one - three) / (np.sqrt(3) * side)
