"""The vertical plane of a goal: an arm that bends in one plane carries no torsion under its weight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.kinematics import Chain, azimuth, straight_yaws
from vgtsim.positioning.objectives import Configurations, Objective, Terms

Array = NDArray[np.float64]

_ON_AXIS = 1e-6  # distance from the mast's axis below which a goal has no plane, m


@dataclass(frozen=True)
class InPlane(Objective):
    """Half the sum of squares of forms on the inputs, shape (r, n), that lead out of a vertical plane.

    Each kind of module names its forms, see `ModuleSet.sideways`.
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
    """The objective for the plane through the mast's axis and a position in G, shape (3,), m.

    For a position on the axis the objective is zero everywhere.
    """
    point = np.asarray(position, float)
    local = (point - chain.mount[:3, 3]) @ chain.mount[:3, :3]
    angle = azimuth(chain, point)
    yaws, known = straight_yaws(chain), float(np.hypot(local[0], local[1]) > _ON_AXIS)
    forms = []
    for place in chain.layout.places:
        for m, (columns, yaw) in enumerate(zip(place.columns, yaws[place.active], strict=True)):
            rows = known * place.modules.sideways(m, angle - yaw)
            form = np.zeros((len(rows), chain.layout.inputs))
            form[:, columns] = rows
            forms.append(form)
    return InPlane(np.concatenate([np.empty((0, chain.layout.inputs)), *forms]))
