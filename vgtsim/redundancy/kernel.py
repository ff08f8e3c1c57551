"""All that one iteration needs of an arm's kinematics, for all modules and a batch at once, without trigonometry.

The formulas are those of `kinematics.double_octahedron` and `kinematics.Chain`, which the tests hold them to. What is
different is the order of the loops: modules are an array axis, and only the products of rotations go module by module.
A configuration that does not assemble is marked, not refused: one bad trial must not stop a batch.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.manipulator import DoubleOctahedral
from vgtsim.description.modules import Prism
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.double_octahedron import face_nodes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class State:
    """Kinematics of a batch of configurations.

    Attributes:
        q: Inputs, shape (b, A, 3).
        R: Rotations of all faces in frame G, shape (b, K + 1, 3, 3).
        P: Their centroids, shape (b, K + 1, 3), m.
        angular: Angular velocity of all beyond a module per input, shape (b, A, 3, 3), in G.
        linear: Velocity of the point at the origin of G, shape (b, A, 3, 3), m.
        length: Actuator lengths, shape (b, A, 3), m.
        blocks: dl/dq, shape (b, A, 3, 3).
        assembles: Which configurations assemble, shape (b,); of the others all values mean nothing.
    """

    q: Array
    R: Array
    P: Array
    angular: Array
    linear: Array
    length: Array
    blocks: Array
    assembles: NDArray[np.bool_]


@dataclass(frozen=True)
class Kernel:
    """An arm of symmetric double octahedra and prisms, ready for batches.

    Attributes:
        chain: The arm.
    """

    chain: Chain

    @cached_property
    def _module(self) -> tuple[Array, Array, Array]:
        """Longeron altitude and joint offset of active modules, shape (A,) each, and the way of each module (K,)."""
        heights = np.array([geometry.height for geometry in self.chain.geometries])
        offsets = np.array([geometry.joint_offset for geometry in self.chain.geometries])
        ways = [m.length if isinstance(m, Prism) else 0.0 for m in self.chain.manipulator.modules]
        return heights, offsets, np.array(ways)

    @cached_property
    def _circles(self) -> tuple[Array, Array]:
        """Centres and inward directions of the circles of n4, n5, n6 (3.28), shape (3, 3) each."""
        nodes = face_nodes(self.chain.manipulator.face_side)
        start, end = nodes[[2, 0, 1]], nodes[[0, 1, 2]]
        return (start + end) / 2, np.cross([0.0, 0.0, 1.0], (end - start) / self.chain.manipulator.face_side)

    def state(self, q: Array) -> State:
        """Kinematics of inputs of shape (b, A, 3)."""
        flat = q[..., 0] ** 2 + q[..., 1] ** 2
        upright = flat < 0.98
        g = np.where(upright[..., None], q, self.chain.straight)
        U = np.concatenate([g[..., :2], np.sqrt(1 - np.where(upright, flat, 0.0))[..., None]], axis=-1)
        length, blocks, closes = self._lengths(g, U)
        R, P, spin, slide, before = self._frames(g, U)
        angular = spin @ np.swapaxes(before, -1, -2)
        linear = slide @ np.swapaxes(before, -1, -2) - cross(angular, P[:, self._top, None, :])
        return State(q, R, P, angular, linear, length, blocks, np.all(upright & closes, axis=1))

    @cached_property
    def _top(self) -> NDArray[np.intp]:
        """Face on top of each active module, shape (A,)."""
        modules = self.chain.manipulator.modules
        return np.array([k + 1 for k, module in enumerate(modules) if isinstance(module, DoubleOctahedral)])

    def _frames(self, g: Array, U: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Faces, and each module's spin and slide per input in its base frame, with that frame's rotation."""
        x, y, z = U[..., 0], U[..., 1], U[..., 2]
        turn = np.eye(3) - 2 * U[..., :, None] * U[..., None, :]
        turn[..., 2] *= -1
        way = 2 * g[..., 2] + self._module[1]
        spin, slide = np.empty((*g.shape, 3)), np.zeros((*g.shape, 3))
        spin[..., 0, :] = 2 * np.stack([-x * y / z, z + x * x / z, -y], axis=-1)
        spin[..., 1, :] = 2 * np.stack([-y * y / z - z, x * y / z, x], axis=-1)
        spin[..., 2, :] = 0.0
        slide[..., 0, 0] = slide[..., 1, 1] = way
        slide[..., 0, 2], slide[..., 1, 2] = -way * x / z, -way * y / z
        slide[..., 2, :] = 2 * U
        ways = self._module[2]
        R, P = np.empty((len(g), len(ways) + 1, 3, 3)), np.empty((len(g), len(ways) + 1, 3))
        R[:, 0], P[:, 0] = self.chain.mount[:3, :3], self.chain.mount[:3, 3]
        shift, active = way[..., None] * U, 0
        for k, length in enumerate(ways):
            if k + 1 in self._top:
                R[:, k + 1] = R[:, k] @ turn[:, active]
                P[:, k + 1] = P[:, k] + (R[:, k] @ shift[:, active, :, None])[..., 0]
                active += 1
            else:
                R[:, k + 1] = R[:, k]
                P[:, k + 1] = P[:, k] + length * R[:, k, :, 2]
        return R, P, spin, slide, R[:, self._top - 1]

    def _lengths(self, g: Array, U: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Actuator lengths, their derivatives and whether the mid-plane meets all circles, shape (b, A)."""
        centre, inward = self._circles
        h = self._module[0][:, None]
        lean = U @ inward.T
        z = U[..., 2:]
        size = np.sqrt(lean * lean + z * z)
        cosine = (g[..., 2:] - U @ centre.T) / (h * size)
        closes = np.all(np.abs(cosine) < 1, axis=-1)
        sine = np.sqrt(np.maximum(1 - cosine * cosine, 1e-12))
        cos, sin = (lean * cosine - z * sine) / size, (z * cosine + lean * sine) / size
        nodes = centre + (h * cos)[..., None] * inward
        nodes[..., 2] += h * sin
        tangent = (-h * sin)[..., None] * inward
        tangent[..., 2] += h * cos
        scale = 1 / (h * (cos * z - sin * lean))
        rate = np.empty((*g.shape, 3))
        rate[..., 0] = -(nodes[..., 0] - nodes[..., 2] * U[..., :1] / z)
        rate[..., 1] = -(nodes[..., 1] - nodes[..., 2] * U[..., 1:2] / z)
        rate[..., 2] = 1.0
        rate *= scale[..., None]
        ahead = [1, 2, 0]
        span = nodes[..., ahead, :] - nodes
        length = np.sqrt(np.sum(span * span, axis=-1))
        span /= length[..., None]
        far = np.sum(span * tangent[..., ahead, :], axis=-1)[..., None] * rate[..., ahead, :]
        return length, far - np.sum(span * tangent, axis=-1)[..., None] * rate, closes


def cross(a: Array, b: Array) -> Array:
    """Cross product along the last axis, shapes (..., 3); `np.cross` takes three times as long."""
    x = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    y = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    z = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return np.stack([x, y, z], axis=-1)
