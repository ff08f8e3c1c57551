"""Feels what an arm touches in a step, and tells loads from collisions.

MuJoCo's search for contacts costs time, so a stage leaves it out of steps in which nothing can touch. Of an arm with rigid
sections, which MuJoCo lets touch nothing, a lookout finds contacts from the distances between its parts and the tank's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vgtsim.arrays import Array
from vgtsim.graphics import mujoco
from vgtsim.log import Contact
from vgtsim.plant.gauges import Gauges, SectionGauges
from vgtsim.plant.loads import Digger
from vgtsim.plant.watch import list_contacts, turn_force
from vgtsim.proximity import Proximity
from vgtsim.site import Site
from vgtsim.touches import Parts

_CONTACT = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
_OVERRIDE = int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
_REACH = 0.3  # m: a look so far costs a quarter more than the search of a step; shorter ones cost no less
# Of the least distance at a look, that a point of `Proximity.points` may have moved since, of the arm alone and of two parts
# that each go their way: nothing has touched anything before the next look. A quarter is left: of a lookout for distances from
# the riser's mouth, which are found to a thousandth of a member's length; of a stage for corners of a tip plate, which stand off
# its nodes, and for places that are foreseen, not measured.
_ONE, _TWO = 3 / 4, 3 / 8
_WAIT = 8  # steps that are searched without a look where looks do not last: a look then costs two parts in a hundred of a step


class Touched(NamedTuple):
    """Contacts with their forces on the arm: loads are allowed, collisions are not."""

    loads: list[Contact]
    collisions: list[Contact]


class Feeler:
    """Lists the contacts of a plant's last step; its `stage` is to be told of each step before and after it."""

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, site: Site, gauges: Gauges, digger: Digger | None
    ) -> None:
        """Feel nothing yet; a digger tells the heights of waste that is cut."""
        self._model, self._data, self._gauges, self._digger = model, data, gauges, digger
        self._lookout = Lookout(site) if isinstance(gauges, SectionGauges) else None
        self._parts, self._yields = Parts(site), site.yields
        self.stage = ContactStage(model, site, gauges)

    def list_contacts(self) -> list[Contact]:
        """What touches at the begin of the last step."""
        data = self._data
        if self._lookout is None:
            return list_contacts(self._model, data, forces=self._yields) if data.ncon else []
        nodes, tool = data.site_xpos.take(self._gauges.nodes, axis=0), data.site_xpos[self._gauges.tool]
        heights = None if self._digger is None else self._digger.heights
        return self._lookout.look(data.time - self._model.opt.timestep, nodes, tool, heights)

    def sort(self, contacts: list[Contact]) -> Touched:
        """Tell loads from collisions: under imposed lengths of rigid members, which yield nothing, all are collisions."""
        loads, collisions = [], []
        for contact in contacts:
            allowed = self._yields and self._parts.find_rule(contact[1:3]) is not None
            (loads if allowed else collisions).append(turn_force(contact, self._parts))
        return Touched(loads, collisions)


class Lookout:
    """Measures distances whenever a part of the arm has moved by a share of the least of them."""

    def __init__(self, site: Site) -> None:
        """Look at the first step."""
        self._near, self._room, self._places = Proximity(site), -np.inf, np.empty((0, 3))
        self._coming = sorted(site.tank.appearances.values(), reverse=True)

    def look(self, time: float, nodes: Array, tool: Array, heights: Array | None = None) -> list[Contact]:
        """List what touches at a time, s.

        Nodes have shape (N, 3) and the tool point shape (3,), m. Heights, shape (P,), m, are those of waste that is cut: it
        falls, so what is far stays far.
        """
        while self._coming and self._coming[-1] <= time:
            self._room = -np.inf
            self._coming.pop()
        near = self._near
        if self._room > 0 and near.stays(nodes, tool, self._places, self._room):
            return []
        self._places = near.points(nodes, tool)
        around, (among, pair) = near.around(nodes, tool, heights), near.among(nodes, tool)
        around = near.leave_out(around, time)
        self._room = _ONE * min(float(around.least), float(among) / 2)
        found = [
            Contact(time=time, first=near.name_around(int(part)), second=place, gap=float(gap))
            for place, gap, part in zip(around.places, around.distance, around.body, strict=True)
            if gap <= 0
        ]
        if among <= 0:
            first, second = (near.name_among(int(part)) for part in pair)
            found.append(Contact(time=time, first=first, second=second, gap=float(among)))
        return found


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
        if not (self._room > 0 and self._near.stays(*self._find_places(sites), self._places, self._room)):
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
        self._room = _TWO * float(there.contact.dist.min(initial=_REACH))
        self._places, self._lasted = self._near.points(*self._find_places(there.site_xpos)), 0
