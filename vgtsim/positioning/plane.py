"""The vertical plane of a goal: an arm that bends in one plane carries no torsion under its weight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.kinematics.bending import azimuth, straight_yaws
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.double_octahedra import DoubleOctahedra
from vgtsim.kinematics.octahedra import Octahedra
from vgtsim.positioning.objectives import Configurations, Objective, Terms

Array = NDArray[np.float64]

_ON_AXIS = 1e-6  # distance from the mast's axis below which a goal has no plane, m


@dataclass(frozen=True)
class InPlane(Objective):
    """Half the sum of squares of what leads out of a vertical plane through the mast.

    Of a double octahedron it is the part of its mid-plane's normal across the plane; of an octahedron those of its top's
    centroid, m, and of its top's normal, to first order about the straight pose; of a hinge nothing.

    Attributes:
        across: The parts as linear forms on the inputs, shape (r, n).
    """

    across: Array
    name: str = "in_plane"

    def terms(self, at: Configurations) -> Terms:
        """In closed form."""
        q = at.state.q
        parts = q @ self.across.T
        curve = np.broadcast_to(self.across.T @ self.across, (len(q), q.shape[1], q.shape[1]))
        return Terms(0.5 * np.sum(parts**2, axis=1), parts @ self.across, dense=curve)


def goal_plane(chain: Chain, position: ArrayLike) -> InPlane:
    """The objective for the plane through the mast's axis and a goal.

    Args:
        chain: The arm.
        position: Of the goal in frame G, shape (3,), m. For a goal on the axis the objective is zero everywhere.
    """
    point = np.asarray(position, float)
    local = (point - chain.mount[:3, 3]) @ chain.mount[:3, :3]
    angle = azimuth(chain, point)
    yaws, known = straight_yaws(chain), float(np.hypot(local[0], local[1]) > _ON_AXIS)
    forms = []
    for place in chain.layout.places:
        for columns, straight, yaw in zip(place.columns, place.straight, yaws[place.active], strict=True):
            x, y = -known * np.sin(angle - yaw), known * np.cos(angle - yaw)
            if isinstance(place.modules, DoubleOctahedra):
                forms.append(_form(chain, columns, [x, y, 0.0]))
            elif isinstance(place.modules, Octahedra):
                cos, sin = np.cos(straight[5]), np.sin(straight[5])
                forms.append(_form(chain, columns, [x, y, 0.0, 0.0, 0.0, 0.0]))
                forms.append(_form(chain, columns, [0.0, 0.0, 0.0, x * sin - y * cos, x * cos + y * sin, 0.0]))
    return InPlane(np.array(forms).reshape(-1, chain.layout.inputs))


def _form(chain: Chain, columns: NDArray[np.intp], weights: list[float]) -> Array:
    row = np.zeros(chain.layout.inputs)
    row[columns] = weights
    return row
