"""Pure kinematics: the module, the chain, the truss they make."""

from vgtsim.kinematics.chain import Chain, hanging_mount
from vgtsim.kinematics.truss import Member, Truss, make_truss

__all__ = ["Chain", "Member", "Truss", "hanging_mount", "make_truss"]
