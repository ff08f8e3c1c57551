"""What the solver makes small: the goal's error and, in its null space, an objective."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics.bending import azimuth
from vgtsim.kinematics.chain import Chain
from vgtsim.redundancy.strokes import StrokeBox
from vgtsim.redundancy.surroundings import Surroundings

Array = NDArray[np.float64]

_HINGE = 100.0  # weight of a clearance hinge; the barrier's slope 2 cm from the end of a stroke is 50 per metre


@dataclass(frozen=True)
class Problem:
    """A goal, what limits the arm, and what it prefers.

    The objective has three terms: the barrier of the strokes, which is least at mid-stroke; hinges that rise
    before the wanted clearance is reached; and the squares of the bends out of the vertical plane of the
    goal, because an arm in one plane carries no torsion under its weight.

    Attributes:
        chain: The arm.
        box: Actuator lengths allowed.
        position: Tool position wanted, in frame G, shape (3,), m.
        direction: Tool direction wanted, in frame G, shape (3,), unit.
        surroundings: What to keep clear of, or None.
        clearance: Clearance wanted, m.
        softness: Width of the clearance hinge beyond it, m.
        sideways: Weight of bends out of the plane.
    """

    chain: Chain
    box: StrokeBox
    position: Array
    direction: Array
    surroundings: Surroundings | None
    clearance: float
    softness: float
    sideways: float

    @cached_property
    def axes(self) -> Array:
        """Two unit vectors across the wanted direction, shape (2, 3)."""
        helper = np.eye(3)[np.argmin(np.abs(self.direction))]
        first = np.cross(self.direction, helper)
        first /= np.linalg.norm(first)
        return np.array([first, np.cross(self.direction, first)], float)

    @cached_property
    def across(self) -> Array:
        """Direction of (u_x, u_y) out of the goal's plane, shape (2,); zero for a goal on the axis."""
        local = (self.position - self.chain.mount[:3, 3]) @ self.chain.mount[:3, :3]
        if np.hypot(local[0], local[1]) < 1e-6:
            return np.zeros(2)
        angle = azimuth(self.chain, self.position)
        return np.array([-np.sin(angle), np.cos(angle)])

    def error(self, q: Array) -> Array:
        """Goal rows: position error, m, and direction error, rad, shape (5,), of inputs of shape (A, 3).

        The direction rows are 2 tan(theta/2) along two axes across the wanted direction: theta to third
        order, and growing up to the opposite direction.
        """
        position, direction = self.chain.tool(q)
        turn = 2 * (self.axes @ direction) / max(1 + self.direction @ direction, 1e-6)
        return np.concatenate([position - self.position, turn])

    def error_jacobian(self, q: Array) -> Array:
        """Derivative of the goal rows, shape (5, 3 A)."""
        direction = self.chain.tool(q)[1]
        J = self.chain.jacobian(q)
        rate = np.cross(J[3:].T, direction).T
        scale = max(1 + self.direction @ direction, 1e-6)
        turn = 2 * (self.axes @ rate) / scale
        turn -= 2 * np.outer(self.axes @ direction, self.direction @ rate) / scale**2
        return np.concatenate([J[:3], turn])

    def objective(self, q: Array, length: Array) -> float:
        """Value of the objective for inputs of shape (A, 3) and their actuator lengths, shape (A, 3), m."""
        value = float(self.box.barrier(length)) + 0.5 * self.sideways * float(np.sum((q[:, :2] @ self.across) ** 2))
        if self.surroundings is not None:
            rows = self.surroundings.rows(q[None], self.clearance + self.softness, slopes=False)
            value += 0.5 * _HINGE * float(np.sum(self._excess(rows.gap) ** 2))
        return value

    def slopes(self, q: Array) -> tuple[Array, Array]:
        """Slope, shape (3 A,), and Gauss-Newton matrix, shape (3 A, 3 A), of the objective."""
        length, blocks = self.chain.length_jacobian(q)
        first, second = self.box.slopes(length)
        curve = np.einsum("aij,ai,aik->ajk", blocks, second, blocks)
        curve[:, :2, :2] += self.sideways * np.outer(self.across, self.across)
        pull = np.einsum("aij,ai->aj", blocks, first)
        pull[:, :2] += self.sideways * (q[:, :2] @ self.across)[:, None] * self.across
        H = np.zeros((len(q), 3, len(q), 3))
        diagonal = np.arange(len(q))
        H[diagonal, :, diagonal, :] = curve
        H, g = H.reshape(q.size, q.size), pull.ravel()
        if self.surroundings is not None:
            rows = self.surroundings.rows(q[None], self.clearance + self.softness)
            g = g - _HINGE / self.softness * self._excess(rows.gap) @ rows.gradient
            H = H + _HINGE / self.softness**2 * rows.gradient.T @ rows.gradient
        return g, H

    def _excess(self, gap: Array) -> Array:
        """Hinge of each gap: 0 where it begins, 1 at the wanted clearance."""
        return (self.clearance - gap) / self.softness + 1
