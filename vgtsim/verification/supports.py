"""The loads of the arm and its mast on what carries them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.runlog import RunLog
from vgtsim.site import Site

Array = NDArray[np.float64]


def find_riser_reaction(site: Site, log: RunLog) -> Array:
    """Force and moment of arm and mast on the riser, which the dome must not carry.

    Returns:
        About the tank's axis at the crown, in frame G, shape (T, 6), N and N·m.
    """
    force, moment = -log.mast_reaction[:, :3], -log.mast_reaction[:, 3:]
    lever = np.array([0.0, 0.0, -site.task.mast.pivot_depth])
    weight = np.array([0.0, 0.0, -site.mast.mass * site.task.simulation.gravity])
    return np.concatenate([force + weight, moment + np.cross(lever, force)], axis=1)
