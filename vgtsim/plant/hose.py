"""The couples of a bent hose on the faces of the simulated arm."""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.graphics import mujoco
from vgtsim.site import Site
from vgtsim.statics import hose_forces


class Hose:
    """Presses on the bodies that carry the faces' nodes, in each step as the arm is bent at its begin."""

    def __init__(self, model: mujoco.MjModel, site: Site, nodes: Index) -> None:
        """Look up the bodies; `nodes` are the sites of the nodes, shape (N,)."""
        truss = site.truss
        self._loads, self._nodes = site.load_model, nodes
        self._moved = np.unique(truss.faces)
        self._bodies = np.array(model.site_bodyid)[nodes[self._moved]]

    def press(self, data: mujoco.MjData, wrenches: Array) -> None:
        """See `correction.Load`."""
        nodes = data.site_xpos[self._nodes]
        force = hose_forces(self._loads, nodes)[self._moved]
        lever = nodes[self._moved] - data.xipos[self._bodies]
        np.add.at(wrenches, self._bodies, np.concatenate([force, np.cross(lever, force)], axis=1))
