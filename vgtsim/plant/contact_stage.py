"""MuJoCo's search for contacts, which is left out of steps in which nothing can touch, since it costs time."""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array
from vgtsim.graphics import mujoco
from vgtsim.plant.gauges import Gauges
from vgtsim.proximity import Proximity
from vgtsim.site import Site

_CONTACT = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
_OVERRIDE = int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
_REACH = 0.3  # m: a look so far costs a quarter more than the search of a step; shorter ones cost no less
# Of the least distance at a look, that a point of `Proximity.points` may have moved since: two parts each go their way. A
# quarter is left for corners of a tip plate, which stand off its nodes, and for places that are foreseen, not measured.
_SHARE = 3 / 8
_WAIT = 8  # steps that are searched without a look where looks do not last: a look then costs two parts in a hundred of a step


class ContactStage:
    """Switches the search of a model whose geoms touch on and off; a look finds all that is within reach, by the same geoms."""

    def __init__(self, model: mujoco.MjModel, site: Site, gauges: Gauges) -> None:
        """Look at the first step; a model in which nothing touches anything stays as it is."""
        self._model, self._gauges, self._near = model, gauges, Proximity(site)
        self._there = mujoco.MjData(model)
        self.forget()
        self._places, self._wait, self._lasted = np.empty((0, 3)), 0, _WAIT
        self._off = bool(model.opt.disableflags & _CONTACT)

    def forget(self) -> None:
        """Look again at the next step: there are other things to touch."""
        self._room = -np.inf

    def prepare(self, data: mujoco.MjData, sites: Array) -> None:
        """Leave the search out of the coming step if nothing can touch at its begin, when sites are at (sites, 3), m."""
        if self._off:
            return
        if self._wait:
            self._wait -= 1
            return
        if not self._is_clear(sites):
            if self._lasted < 1:
                self._wait = _WAIT
            self._look(data)
        else:
            self._lasted += 1
        if self._room > 0:
            self._model.opt.disableflags |= _CONTACT

    def restore(self) -> None:
        """Switch the search on again after the step."""
        if not self._off and self._model.opt.disableflags & _CONTACT:
            self._model.opt.disableflags &= ~_CONTACT

    def _is_clear(self, sites: Array) -> bool:
        return self._room > 0 and self._near.stays(*self._find_places(sites), self._places, self._room)

    def _find_places(self, sites: Array) -> tuple[Array, Array]:
        return sites.take(self._gauges.nodes, axis=0), sites[self._gauges.tool]

    def _look(self, data: mujoco.MjData) -> None:
        """Measure the least distance now, up to the reach."""
        model, there = self._model, self._there
        there.qpos = data.qpos
        mujoco.mj_kinematics(model, there)
        flags, margin = model.opt.enableflags, model.opt.o_margin
        model.opt.enableflags, model.opt.o_margin = flags | _OVERRIDE, _REACH
        mujoco.mj_collision(model, there)
        model.opt.enableflags, model.opt.o_margin = flags, margin
        self._room = _SHARE * float(there.contact.dist.min(initial=_REACH))
        self._places, self._lasted = self._near.points(*self._find_places(there.site_xpos)), 0
