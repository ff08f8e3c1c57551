"""MuJoCo simulation and verification of long-reach variable-geometry-truss manipulators.

The names here are all that a user needs; `docs/python.md` lists them. Each is imported on first use, so `import vgtsim` is
quick, loads no MuJoCo and changes no setting.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vgtsim.mjcf import build_model, load_model
    from vgtsim.output import film as render
    from vgtsim.output import write_outputs as write
    from vgtsim.planning import plan_tour as plan
    from vgtsim.plant import Plant, run
    from vgtsim.posture import Posture, forward_kinematics, jacobian, member_forces, solve_goal
    from vgtsim.site import Site, load_arm
    from vgtsim.site import load_site as load
    from vgtsim.verification import verify

__version__ = "0.2.0"
__all__ = [
    "Plant",
    "Posture",
    "Site",
    "__version__",
    "build_model",
    "forward_kinematics",
    "jacobian",
    "load",
    "load_arm",
    "load_model",
    "member_forces",
    "plan",
    "render",
    "run",
    "solve_goal",
    "verify",
    "write",
]

_HOME = {  # of each name: its room, and its name there if that is another
    "Plant": ("plant", "Plant"),
    "Posture": ("posture", "Posture"),
    "Site": ("site", "Site"),
    "build_model": ("mjcf", "build_model"),
    "forward_kinematics": ("posture", "forward_kinematics"),
    "jacobian": ("posture", "jacobian"),
    "load": ("site", "load_site"),
    "load_arm": ("site", "load_arm"),
    "load_model": ("mjcf", "load_model"),
    "member_forces": ("posture", "member_forces"),
    "plan": ("planning", "plan_tour"),
    "render": ("output", "film"),
    "run": ("plant", "run"),
    "solve_goal": ("posture", "solve_goal"),
    "verify": ("verification", "verify"),
    "write": ("output", "write_outputs"),
}


def __getattr__(name: str) -> Any:
    """Import a public name on first use."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    room, home = _HOME[name]
    return getattr(import_module(f"vgtsim.{room}"), home)


def __dir__() -> list[str]:
    """The public names."""
    return __all__
