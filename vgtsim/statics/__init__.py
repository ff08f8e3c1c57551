"""Forces in the truss and what they use of its strength, independent of MuJoCo."""

from vgtsim.statics.equilibrium import MemberForces, solve_members
from vgtsim.statics.loads import LoadModel, make_load_model
from vgtsim.statics.motion import NodeMotion, motion_from_log
from vgtsim.statics.rank import diagnose
from vgtsim.statics.rating import MemberSections, Ratings, make_sections, rate
from vgtsim.statics.utilisation import Utilisation, find_use, smooth_peak, utilise

__all__ = [
    "LoadModel",
    "MemberForces",
    "MemberSections",
    "NodeMotion",
    "Ratings",
    "Utilisation",
    "diagnose",
    "find_use",
    "make_load_model",
    "make_sections",
    "motion_from_log",
    "rate",
    "smooth_peak",
    "solve_members",
    "utilise",
]
