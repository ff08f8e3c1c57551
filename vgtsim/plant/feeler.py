"""Feels what an arm touches in a step, and tells loads from collisions."""

from __future__ import annotations

from typing import NamedTuple

from vgtsim.arrays import Array
from vgtsim.graphics import mujoco
from vgtsim.plant.contact_stage import ContactStage
from vgtsim.plant.digger import Digger
from vgtsim.plant.gauges import Gauges
from vgtsim.plant.lookout import Lookout
from vgtsim.plant.watch import Contact, list_contacts, turn_force
from vgtsim.site import Site
from vgtsim.touches import Parts


class Touched(NamedTuple):
    """Contacts with their forces on the arm: loads are allowed, collisions are not."""

    loads: list[Contact]
    collisions: list[Contact]


class Feeler:
    """Lists the contacts of a plant's last step; a lookout finds them where MuJoCo does not."""

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        site: Site,
        gauges: Gauges,
        lookout: Lookout | None,
        digger: Digger | None,
    ) -> None:
        """Feel nothing yet; a digger tells the heights of waste that is cut."""
        self._model, self._data, self._gauges, self._lookout, self._digger = model, data, gauges, lookout, digger
        self._parts, self._yields = Parts(site), site.yields
        self._stage = ContactStage(model, site, gauges) if lookout is None else None

    def prepare(self, sites: Array) -> None:
        """Leave the search for contacts out of the coming step, when sites are at (sites, 3), m, where there are none."""
        if self._stage is not None:
            self._stage.prepare(self._data, sites)

    def restore(self) -> None:
        """Switch the search on again after the step."""
        if self._stage is not None:
            self._stage.restore()

    def forget(self) -> None:
        """Expect other things to touch from now on."""
        if self._stage is not None:
            self._stage.forget()

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
