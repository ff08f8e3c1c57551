"""Forces in the truss, independent of MuJoCo: method of joints, rank test, member ratings."""

from vgtsim.statics.equilibrium import MemberForces, solve
from vgtsim.statics.loads import LoadModel, make_load_model
from vgtsim.statics.motion import Motion, motion_from_log
from vgtsim.statics.rank import diagnose
from vgtsim.statics.rating import Ratings, Section, Utilisation, make_sections, rate, utilise

__all__ = [
    "LoadModel",
    "MemberForces",
    "Motion",
    "Ratings",
    "Section",
    "Utilisation",
    "diagnose",
    "make_load_model",
    "make_sections",
    "motion_from_log",
    "rate",
    "solve",
    "utilise",
]
