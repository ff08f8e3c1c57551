"""Static sections as kinds of modules: prisms, and sections of any shape; the geometry is in `static_section`."""

from __future__ import annotations

from vgtsim.description import Prism, SectionModule
from vgtsim.errors import TrussError
from vgtsim.kinematics.modules.kind import TRIANGLE, Groups, Kind, PlannedMember
from vgtsim.kinematics.modules.static_section import StaticSection, make_section, section_from_transform


def make_static(module: Prism | SectionModule, side: float) -> StaticSection:
    """Static section of a described module; faces that are not given are the arm's, of a side in m.

    Raises:
        AssemblyError: A measured transform is not a rotation.
        TrussError: The members do not hold it; the module is named.
    """
    base, top = module.faces(side)
    try:
        if isinstance(module, SectionModule) and module.transform is not None:
            return section_from_transform(base, top, module.transform)
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
