"""The vertical plane of a goal: an arm that bends in one plane carries no torsion under its weight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.kinematics.chain import Chain
from vgtsim.redundancy.objectives import Configurations, Terms
from vgtsim.redundancy.seeds import azimuth

Array = NDArray[np.float64]

_ON_AXIS = 1e-6  # distance from the mast's axis below which a goal has no plane, m


@dataclass(frozen=True)
class InPlane:
    """Half the sum of squares of the mid-plane normals' parts across a vertical plane through the mast.

    Attributes:
        across: The parts as linear forms on the inputs, shape (A, n).
    """

    across: Array
    name: str = "in_plane"

    def terms(self, at: Configurations) -> Terms:
        """In closed form."""
        q = at.q.reshape(len(at.q), -1)
        parts = q @ self.across.T
        curve = np.broadcast_to(self.across.T @ self.across, (len(q), q.shape[1], q.shape[1]))
        return Terms(0.5 * np.sum(parts**2, axis=1), parts @ self.across, dense=curve)


def goal_plane(chain: Chain, position: ArrayLike) -> InPlane:
    """The objective for the plane through the mast's axis and a goal.

    Args:
        chain: An arm of double octahedra.
        position: Of the goal in frame G, shape (3,), m.

    Returns:
        The objective; zero everywhere for a goal on the axis.
    """
    point = np.asarray(position, float)
    local = (point - chain.mount[:3, 3]) @ chain.mount[:3, :3]
    angle, count = azimuth(chain, point), len(chain.straight)
    normal = np.array([-np.sin(angle), np.cos(angle), 0.0]) * (np.hypot(local[0], local[1]) > _ON_AXIS)
    return InPlane(np.kron(np.eye(count), normal))
