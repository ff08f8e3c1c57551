"""Static sections from measured nodes, and the lengths of their members (section 3.6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.kinematics.closure import triangle_frame
from vgtsim.kinematics.modules.sets import TRIANGLE
from vgtsim.kinematics.modules.static_section import StaticSection

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


@dataclass(frozen=True)
class SectionMember:
    """One bar of a section, a `longeron`, `cross_longeron` or `batten`, with its length, m.

    Its ends are indices of nodes: 0 to 2 the base, 3 to 5 the top.
    """

    role: str
    ends: tuple[int, int]
    length: float


def list_members(section: StaticSection) -> tuple[SectionMember, ...]:
    """Three longerons, three cross-longerons, three battens."""
    plan = [("longeron", i, 3 + i) for i in range(3)]
    plan += [("cross_longeron", i, 3 + j) for i, j in TRIANGLE]
    plan += [("batten", 3 + i, 3 + j) for i, j in TRIANGLE]
    spans = [float(np.linalg.norm(section.nodes[j] - section.nodes[i])) for _, i, j in plan]
    return tuple(SectionMember(role, (i, j), span) for (role, i, j), span in zip(plan, spans, strict=True))
