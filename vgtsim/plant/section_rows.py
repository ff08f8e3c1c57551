"""Second-order correction of the length rows of an arm with rigid sections."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@njit(cache=True)
def find_row_offsets(
    nodes: Array, after: Array, of_node: Index, origins: Array, ends: Index, offsets: Array
) -> None:  # pragma: no cover
    """Write by how much each row's length changes in a step beyond its linearisation, shape (L,), m.

    MuJoCo solves a step with lengths that are linear in the speeds, and then moves the bodies on: origins of bodies along
    lines, all else of a section on arcs about its origin. The difference of both is known where the motion is.

    Args:
        nodes: Positions at the begin of the step, shape (N, 3), m.
        after: Positions that kinematics give for its end, shape (N, 3), m.
        of_node: Section of each node, shape (N,); 0 does not turn, -1 is a free hub.
        origins: Origins of the sections' bodies at the begin, shape (S, 3), m.
        ends: Nodes of the rows, shape (L, 2).
        offsets: Shape (L,), written.
    """
    count, sections = len(nodes), len(origins)
    middle, moved, size = np.zeros((sections, 3)), np.zeros((sections, 3)), np.zeros(sections)
    for i in range(count):
        s = of_node[i]
        if s > 0:
            size[s] += 1.0
            for k in range(3):
                middle[s, k] += nodes[i, k]
                moved[s, k] += after[i, k]
    normal, right = np.zeros((sections, 3, 3)), np.zeros((sections, 3))
    for s in range(1, sections):
        for k in range(3):
            middle[s, k] /= size[s]
            moved[s, k] /= size[s]
    m, d = np.empty(3), np.empty(3)
    for i in range(count):
        s = of_node[i]
        if s <= 0:
            continue
        for k in range(3):
            first, second = nodes[i, k] - middle[s, k], after[i, k] - moved[s, k]
            m[k], d[k] = (first + second) / 2, second - first
        square = m[0] * m[0] + m[1] * m[1] + m[2] * m[2]
        for j in range(3):
            normal[s, j, j] += square
            for k in range(3):
                normal[s, j, k] -= m[j] * m[k]
        right[s, 0] += m[1] * d[2] - m[2] * d[1]
        right[s, 1] += m[2] * d[0] - m[0] * d[2]
        right[s, 2] += m[0] * d[1] - m[1] * d[0]
    turn, shift = np.zeros((sections, 3)), np.zeros((sections, 3))
    for s in range(1, sections):
        # d = w x m holds for arms turned by an angle with 2 tan(angle / 2) = |w| (Cayley)
        w = np.linalg.solve(normal[s], right[s])
        half = np.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]) / 2
        scale = np.arctan(half) / half if half > 1e-9 else 1.0  # below, the angle is the tangent to the last digit
        angle = 2 * half * scale
        x, y, z = w[0] * scale, w[1] * scale, w[2] * scale
        turn[s, 0], turn[s, 1], turn[s, 2] = x, y, z
        sine = np.sin(angle) / angle if angle > 1e-9 else 1.0
        cosine = 2 * (np.sin(angle / 2) / angle) ** 2 if angle > 1e-9 else 0.5
        ax, ay, az = middle[s, 0] - origins[s, 0], middle[s, 1] - origins[s, 1], middle[s, 2] - origins[s, 2]
        cx, cy, cz = y * az - z * ay, z * ax - x * az, x * ay - y * ax
        shift[s, 0] = moved[s, 0] - middle[s, 0] - sine * cx - cosine * (y * cz - z * cy)
        shift[s, 1] = moved[s, 1] - middle[s, 1] - sine * cy - cosine * (z * cx - x * cz)
        shift[s, 2] = moved[s, 2] - middle[s, 2] - sine * cz - cosine * (x * cy - y * cx)
    linear = np.zeros((count, 3))
    for i in range(count):
        s = of_node[i]
        if s < 0:
            for k in range(3):
                linear[i, k] = after[i, k] - nodes[i, k]
        elif s > 0:
            ax, ay, az = nodes[i, 0] - origins[s, 0], nodes[i, 1] - origins[s, 1], nodes[i, 2] - origins[s, 2]
            x, y, z = turn[s, 0], turn[s, 1], turn[s, 2]
            linear[i, 0] = shift[s, 0] + y * az - z * ay
            linear[i, 1] = shift[s, 1] + z * ax - x * az
            linear[i, 2] = shift[s, 2] + x * ay - y * ax
    for row in range(len(ends)):
        a, b = ends[row, 0], ends[row, 1]
        before, behind, along = 0.0, 0.0, 0.0
        for k in range(3):
            now, then = nodes[b, k] - nodes[a, k], after[b, k] - after[a, k]
            before += now * now
            behind += then * then
            along += now * (linear[b, k] - linear[a, k])
        length = np.sqrt(before)
        offsets[row] = np.sqrt(behind) - length - along / length
