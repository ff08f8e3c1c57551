"""The step loop."""

import vgtsim.graphics  # noqa: F401  before MuJoCo
from vgtsim.plant.loop import run

__all__ = ["run"]
