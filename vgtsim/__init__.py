"""MuJoCo simulation and verification of long-reach variable-geometry-truss manipulators.

The names here are all that a user needs; `docs/python.md` lists them. Each is imported on first use, so `import vgtsim` is
quick, loads no MuJoCo and changes no setting.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vgtsim.control import Controller
    from vgtsim.mjcf import build_model, load_model
    from vgtsim.output import film as render
    from vgtsim.output import write_outputs as write
    from vgtsim.planning import plan_site as plan
    from vgtsim.plant import Plant, operate, run
    from vgtsim.posture import forward_kinematics, jacobian, member_forces, solve_goal
    from vgtsim.site import Site, load_arm
    from vgtsim.site import load_site as load
    from vgtsim.verification import verify

__version__ = "0.3.0.dev0"
__all__ = [
    "Controller",
    "Plant",
    "Site",
    "__version__",
    "build_model",
    "forward_kinematics",
    "jacobian",
    "load",
    "load_arm",
    "load_model",
    "member_forces",
    "operate",
    "plan",
    "render",
    "run",
    "solve_goal",
    "verify",
    "write",
]

_ROOMS = {
    "control": ("Controller",),
    "mjcf": ("build_model", "load_model"),
    "output": ("render", "write"),
    "planning": ("plan",),
    "plant": ("Plant", "operate", "run"),
    "posture": ("forward_kinematics", "jacobian", "member_forces", "solve_goal"),
    "site": ("Site", "load", "load_arm"),
    "verification": ("verify",),
}
_THERE = {"load": "load_site", "plan": "plan_site", "render": "film", "write": "write_outputs"}  # names in their rooms


def __getattr__(name: str) -> Any:
    """Import a public name on first use."""
    for room, names in _ROOMS.items():
        if name in names:
            return getattr(import_module(f"vgtsim.{room}"), _THERE.get(name, name))
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
