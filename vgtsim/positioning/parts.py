"""What one iteration needs of every active module: of all modules of a kind and a batch of configurations at once.

A configuration that does not assemble is marked, not refused: one bad trial must not stop a batch. Double octahedra
have formulas of their own here, those of `kinematics.double_octahedron` without trigonometry, because the rates of
chapter 6 depend on them; the tests hold them to the others. All other kinds are asked of the sets of `kinematics`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics import double_octahedron as double
from vgtsim.kinematics.double_octahedra import DoubleOctahedra
from vgtsim.kinematics.layout import Place
from vgtsim.kinematics.octahedra import Octahedra

Array = NDArray[np.float64]

_FLAT = 0.98  # u_x² + u_y² of a mid-plane's normal from which it counts as lying flat
_PITCH = np.radians(80.0)  # from which roll and yaw are too nearly the same turn


@dataclass(frozen=True)
class Part:
    """The modules of one kind, in their base frames.

    Attributes:
        R: R_BT, shape (b, M, 3, 3).
        P: P_BT, shape (b, M, 3), m.
        spin: Angular velocity of T per input, shape (b, M, inputs, 3).
        slide: Velocity of its origin, shape (b, M, inputs, 3).
        length: Of all legs, static ones included, shape (b, M, legs), m.
        block: Their derivatives, shape (b, M, legs, inputs).
        valid: Which modules assemble, on the mode of the straight arm, shape (b, M).
    """

    R: Array
    P: Array
    spin: Array
    slide: Array
    length: Array
    block: Array
    valid: NDArray[np.bool_]


def solver(place: Place) -> Callable[[Array], Part]:
    """The function from inputs, shape (b, M, inputs), to the part of a set of modules.

    Args:
        place: The set and where it stands.

    Returns:
        The function.
    """
    modules, straight = place.modules, place.straight
    if isinstance(modules, DoubleOctahedra):
        mirror = _mirror(modules, straight)
        return mirror.part
    sign = np.sign(np.linalg.det(modules.length_jacobian(straight)[1]))

    def part(x: Array) -> Part:
        sound = np.all(np.isfinite(x), axis=-1)
        if isinstance(modules, Octahedra):
            sound &= np.abs(x[..., 4]) < _PITCH
        else:
            sound &= (x[..., 0] > 0) & (x[..., 0] < np.pi)
        g = np.where(sound[..., None], x, straight)
        R, P = modules.transform(g)
        spin, slide = modules.twist(g)
        length, block = modules.legs(g)
        # where the determinant changes its sign the module is singular, and beyond it on another assembly mode
        valid = sound & (np.linalg.det(block) * sign > 0)
        return Part(R, P, np.swapaxes(spin, -1, -2), np.swapaxes(slide, -1, -2), length, block, valid)

    return part


@dataclass(frozen=True)
class _Mirror:
    """Symmetric double octahedra.

    Attributes:
        height: Altitude of the longeron triangles, shape (M,), m.
        offset: Joint offset, shape (M,), m.
        straight: Inputs that stand in for those that mean nothing, shape (M, 3).
        centre: Of the circles of n4, n5, n6 (3.28), shape (3, 3), m.
        inward: Of their planes, shape (3, 3).
    """

    height: Array
    offset: Array
    straight: Array
    centre: Array
    inward: Array

    def part(self, x: Array) -> Part:
        """The modules' part."""
        flat = x[..., 0] ** 2 + x[..., 1] ** 2
        upright = flat < _FLAT
        g = np.where(upright[..., None], x, self.straight)
        U = np.concatenate([g[..., :2], np.sqrt(1 - np.where(upright, flat, 0.0))[..., None]], axis=-1)
        length, block, closes = self._lengths(g, U)
        a, b, c = U[..., 0], U[..., 1], U[..., 2]
        turn = np.eye(3) - 2 * U[..., :, None] * U[..., None, :]
        turn[..., 2] *= -1
        way = 2 * g[..., 2] + self.offset
        spin, slide = np.empty((*g.shape, 3)), np.zeros((*g.shape, 3))
        spin[..., 0, :] = 2 * np.stack([-a * b / c, c + a * a / c, -b], axis=-1)
        spin[..., 1, :] = 2 * np.stack([-b * b / c - c, a * b / c, a], axis=-1)
        spin[..., 2, :] = 0.0
        slide[..., 0, 0] = slide[..., 1, 1] = way
        slide[..., 0, 2], slide[..., 1, 2] = -way * a / c, -way * b / c
        slide[..., 2, :] = 2 * U
        return Part(turn, way[..., None] * U, spin, slide, length, block, upright & closes)

    def _lengths(self, g: Array, U: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Actuator lengths, their derivatives and whether the mid-plane meets all circles, shape (b, M)."""
        centre, inward = self.centre, self.inward
        h = self.height[:, None]
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


def _mirror(modules: DoubleOctahedra, straight: Array) -> _Mirror:
    geometry = modules.geometry
    side = float(np.asarray(geometry.face_side).ravel()[0])  # all faces of double octahedra are the arm's
    nodes = double.face_nodes(side)
    start, end = nodes[[2, 0, 1]], nodes[[0, 1, 2]]
    count = len(modules.names)
    height, offset = (np.broadcast_to(item, count) for item in (geometry.height, geometry.joint_offset))
    return _Mirror(height, offset, straight, (start + end) / 2, np.cross([0.0, 0.0, 1.0], (end - start) / side))
