"""A bent hose in the arm as forces at the nodes of the faces that it passes.

Between two faces a hose lies in an arc, whose curvature times its stiffness EI is the couple with which it straightens. It slides
in the faces, so it carries no force along itself. Its weight stands in `LoadModel.hub_mass`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics import Truss, find_axis

Array = NDArray[np.float64]


def hose_couples(truss: Truss, stiffness: float, nodes: Array) -> Array:
    """Couples of a hose of a stiffness EI, N·m², on the faces, shape (T, K + 1, 3), N·m, for nodes of shape (T, N, 3), m.

    Source: M = EI / R, the elastica between parallel guides of its ends.
    """
    axis = find_axis(truss, nodes)
    bent = stiffness * (axis.angle / axis.length)[..., None] * axis.bend
    total = np.zeros(axis.places.shape)
    total[:, :-1] += bent
    total[:, 1:] -= bent
    return total
