"""Forces in the truss, its elasticity, and what it uses of its strength; independent of MuJoCo."""

from vgtsim.statics.capacity import GREATEST_BEND, CapacityMap, draw_shapes, find_gain, map_capacity
from vgtsim.statics.cases import Envelope, find_envelope
from vgtsim.statics.elasticity import TRAPPED, ElasticModel, hold_cylinders, make_elastic_model, require_no_offset
from vgtsim.statics.equilibrium import Loading, MemberForces, solve_loadings, solve_members
from vgtsim.statics.framework import diagnose
from vgtsim.statics.loads import LoadModel, hose_forces, make_load_model, tool_forces, tool_point, weigh
from vgtsim.statics.modes import damping_time, find_modes
from vgtsim.statics.motion import NodeMotion, motion_from_log
from vgtsim.statics.rating import (
    ROD_FACTOR,
    SLENDERNESS_ADVICE,
    MemberSections,
    Ratings,
    effective_area,
    elastic_stress,
    is_inelastic,
    make_sections,
    rate,
    rod_buckling,
)
from vgtsim.statics.sizing import Demand, Sizing, grow_sizes, size_arm
from vgtsim.statics.stiffness import deflect, node_loads, settle
from vgtsim.statics.utilisation import MODES, Utilisation, find_use, smooth_peak, utilise

__all__ = [
    "GREATEST_BEND",
    "MODES",
    "ROD_FACTOR",
    "SLENDERNESS_ADVICE",
    "TRAPPED",
    "CapacityMap",
    "Demand",
    "ElasticModel",
    "Envelope",
    "LoadModel",
    "Loading",
    "MemberForces",
    "MemberSections",
    "NodeMotion",
    "Ratings",
    "Sizing",
    "Utilisation",
    "damping_time",
    "deflect",
    "diagnose",
    "draw_shapes",
    "effective_area",
    "elastic_stress",
    "find_envelope",
    "find_gain",
    "find_modes",
    "find_use",
    "grow_sizes",
    "hold_cylinders",
    "hose_forces",
    "is_inelastic",
    "make_elastic_model",
    "make_load_model",
    "make_sections",
    "map_capacity",
    "motion_from_log",
    "node_loads",
    "rate",
    "require_no_offset",
    "rod_buckling",
    "settle",
    "size_arm",
    "smooth_peak",
    "solve_loadings",
    "solve_members",
    "tool_forces",
    "tool_point",
    "utilise",
    "weigh",
]
