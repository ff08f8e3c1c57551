"""MuJoCo simulation and verification of long-reach variable-geometry-truss manipulators."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vgtsim.description import load_scene
    from vgtsim.mjcf import build_model, load_model

__version__ = "0.2.0"
__all__ = ["__version__", "build_model", "load_model", "load_scene"]


def __getattr__(name: str) -> Any:
    """Import the public functions on first use, so that reading a description needs no MuJoCo."""
    if name == "load_scene":
        from vgtsim.description import load_scene

        return load_scene
    if name in ("build_model", "load_model"):
        from vgtsim import mjcf

        return getattr(mjcf, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
