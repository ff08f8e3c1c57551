"""Static sections: two face triangles held together by longerons and diagonals (section 3.6), and their kinds of modules.

The chain needs the transform from the top face of a section to its base; it comes from dimensions or from a measurement.
Longerons 1 to 3 join corners 1 to 3 of the base to those of the top. Cross-longerons 1 to 3 join corners 1 to 3 of the base
to corners 2, 3, 1 of the top. Battens 1 to 3 are the edges 12, 23, 31 of the top. The base battens belong to the module below.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import Prism, SectionModule
from vgtsim.errors import AssemblyError, TrussError
from vgtsim.kinematics.closure import triangle_nodes
from vgtsim.kinematics.mode_following import worst_direction
from vgtsim.kinematics.modules.octahedron import leg_jacobian, twist_units
from vgtsim.kinematics.modules.sets import TRIANGLE, Groups, Kind, PlannedMember
from vgtsim.kinematics.roll_pitch_yaw import rotation

Sides = tuple[float, float, float]

_LEGS = np.array([(0, 0), (1, 1), (2, 2), *TRIANGLE])  # corner of the base and of the top
_RIGID = 1e-3  # smallest singular value, a pure number, below which a section is a mechanism for all purposes
_SQUARE = 1e-6  # departure of a measured rotation from an orthogonal matrix that is taken for rounding


@dataclass(frozen=True)
class StaticSection:
    """Sides 12, 23, 31 of the base and top triangles of a static section, m, with R_BT, (3, 3), and P_BT, (3,), m.

    Raises:
        AssemblyError: Sides form no triangle, or R_BT is no rotation by more than a measurement's rounding.
        TrussError: The members do not hold the faces; the member is named.
    """

    base: Sides
    top: Sides
    R: Array
    P: Array

    def __post_init__(self) -> None:
        """Copy the transform, and refuse one that is no rotation or a section that is a mechanism."""
        for name in ("R", "P"):
            value = np.array(getattr(self, name), float)
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        skew = float(np.max(np.abs(self.R @ self.R.T - np.eye(3))))
        if skew > _SQUARE or np.linalg.det(self.R) < 0:
            raise AssemblyError("static section", skew, "R_BT is not a rotation matrix")
        _, J = leg_jacobian(self.nodes[_LEGS[:, 0]], self.nodes[3 + _LEGS[:, 1]], self.P)
        value, leg = worst_direction(J, twist_units(triangle_nodes(self.top)))
        if value < _RIGID:
            role = "longeron" if leg < 3 else "cross_longeron"
            raise TrussError(
                8, (f"{role}/{leg % 3 + 1}",), f"static section is a mechanism: singular value {value:.2g}"
            )

    @property
    def transform(self) -> Array:
        """T_BT, shape (4, 4)."""
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = self.R, self.P
        return T

    @cached_property
    def nodes(self) -> Array:
        """Corners 1 to 3 of the base and 1 to 3 of the top in frame B, shape (6, 3), m."""
        return np.concatenate([triangle_nodes(self.base), triangle_nodes(self.top) @ self.R.T + self.P])


def make_section(
    base: Sides, length: float, *, top: Sides | None = None, tilt: tuple[float, float] = (0.0, 0.0), twist: float = 0.0
) -> StaticSection:
    """Section from its dimensions (section 3.6 and figure 3.14).

    Args:
        base: Sides 12, 23, 31 of the base triangle, m.
        length: Distance between the centroids of the faces along the base's normal, m.
        top: Sides of the top triangle, m; absent for those of the base: a prism. Smaller ones taper it.
        tilt: Roll about X_B and pitch about Y_B of the top face, rad: end faces that are not parallel.
        twist: Turn of the top face about its own normal, rad.
    """
    R = rotation([tilt[0], tilt[1], 0.0]) @ rotation([0.0, 0.0, twist])
    return StaticSection(base, base if top is None else top, R, np.array([0.0, 0.0, length]))


def make_static(module: Prism | SectionModule, side: float) -> StaticSection:
    """Static section of a described module; faces that are not given are the arm's, of a side in m.

    Raises:
        AssemblyError: A measured transform is not a rotation.
        TrussError: The members do not hold it; the module is named.
    """
    base, top = module.faces(side)
    try:
        if isinstance(module, SectionModule) and module.transform is not None:
            T = np.array(module.transform)
            return StaticSection(base, top, T[:3, :3], T[:3, 3])
        tilt, twist = (module.tilt, module.twist) if isinstance(module, SectionModule) else ((0.0, 0.0), 0.0)
        return make_section(base, module.length or 0.0, top=top, tilt=tilt, twist=twist)
    except TrussError as error:
        members = tuple(f"{module.name}/{member}" for member in error.members)
        raise TrussError(error.rank, members, f"{module.name}: a static section whose members do not hold it") from None


def plan_members(module: Prism | SectionModule, groups: Groups) -> list[PlannedMember]:
    """Three longerons and three diagonals."""
    base, top = groups["base"], groups["top"]
    plan = [PlannedMember("longeron", module.longeron_tube, base[i], top[i], i + 1) for i in range(3)]
    tube = module.cross_longeron_tube
    return plan + [PlannedMember("cross_longeron", tube, base[i], top[j], i + 1) for i, j in TRIANGLE]


KIND = Kind(plan=plan_members, make_static=make_static)
