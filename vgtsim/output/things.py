"""Where the names of what stands in a tank are written in pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.geometry import obstacles
from vgtsim.site import Site

Array = NDArray[np.float64]

_MOST_NAMES = 6  # of equipment; the names of more would hide it


def name_things(site: Site) -> dict[str, Array]:
    """Places of the names of what is in the tank, shape (3,), m, by name: waste, and the equipment unless it is much."""
    around, level = obstacles(site.tank), site.tank.waste.level
    heights = np.linspace(0.8, 0.3, len(around.names))[:, None]  # of each, so that names beside one another do not meet
    places = (1 - heights) * around.axes[:, 0] + heights * around.axes[:, 1]
    named = len(around.names) <= _MOST_NAMES
    things = {name.replace("_", " "): place for name, place in zip(around.names, places, strict=True) if named}
    front = np.array([0.0, -site.tank.shell.inner_diameter / 8, level])  # where the arm seldom hides it
    return things | ({site.tank.waste.kind: front} if level else {})
