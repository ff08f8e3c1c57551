"""Static sections from measured nodes (section 3.6)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.kinematics.modules.static_section import StaticSection
from vgtsim.kinematics.triangle import triangle_frame

Array = NDArray[np.float64]


def section_from_nodes(nodes: ArrayLike) -> tuple[StaticSection, Array, Array]:
    """Section from its measured nodes.

    Args:
        nodes: Corners 1 to 3 of the base and 1 to 3 of the top in any frame F, shape (6, 3), m.

    Returns:
        The section, and the rotation, shape (3, 3), and origin, shape (3,), m, of its frame B in F.

    Raises:
        TrussError: The members do not hold the faces.
    """
    n = np.asarray(nodes, float)
    R_B, P_B = triangle_frame(n[:3])
    R_T, P_T = triangle_frame(n[3:])
    base, top = ((*np.linalg.norm(face[[1, 2, 0]] - face, axis=-1).tolist(),) for face in (n[:3], n[3:]))
    return StaticSection(base, top, R_B.T @ R_T, R_B.T @ (P_T - P_B)), R_B, P_B
