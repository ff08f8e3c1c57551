"""Contacts of a run: which part of the arm touches which place, whether the scene allows it, and what that does to the arm.

The names of parts and places are those of the log: geoms of the model, of which those of the tank begin with `tank/`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.description import AllowedContact
from vgtsim.geometry import RISER, SHELL, WASTE
from vgtsim.log import RunLog
from vgtsim.site import Site
from vgtsim.statics import LoadModel, tool_forces

_TANK, _ROD = "tank/", "/rod"
_TOOL = ("payload", "tip")
_MAST = "mast"
_INSTANT = 1e-6  # of the time between records, by which rounding may move the instant of a contact


@dataclass(frozen=True, eq=False)
class Parts:
    """Names of a site's geoms, as parts of the arm or as places."""

    site: Site

    @cached_property
    def _nodes(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self.site.truss.nodes)}

    @cached_property
    def _members(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self.site.truss.member_names)}

    def find_part(self, geom: str) -> str:
        """Kind of part that a geom belongs to, see `AllowedContact`; empty for what is not of the arm."""
        if geom == _MAST:
            return "mast"
        if geom in _TOOL:
            return "tool"
        if (node := self._nodes.get(geom)) is not None:
            return "tool" if node in range(len(self._nodes))[self.site.truss.tip] else "hubs"
        return "members" if geom.removesuffix(_ROD) in self._members else ""

    def find_node(self, geom: str) -> int | None:
        """Index of the node that a geom is the hub of."""
        return self._nodes.get(geom)

    def find_segment(self, geom: str) -> tuple[int, bool] | None:
        """Index of the member that a geom belongs to, and whether it is a rod."""
        index = self._members.get(geom.removesuffix(_ROD))
        return None if index is None else (index, geom.endswith(_ROD))

    def find_place(self, geom: str) -> str:
        """Place that a geom belongs to, see `AllowedContact`; something that is not of the tank is a place of its own."""
        if not geom.startswith(_TANK):
            return geom
        name = geom.removeprefix(_TANK).split("/")[0]
        if name == self.site.tank.arm_riser.name:
            return RISER
        return name if name in (WASTE, *(item.name for item in self.site.tank.things)) else SHELL

    def split(self, pair: Sequence[str]) -> tuple[str, str]:
        """The geom of the arm and the other one of a pair; of two of the arm, the second one first."""
        first, second = pair
        return (second, first) if self.find_part(second) else (first, second)

    def find_rule(self, pair: Sequence[str]) -> AllowedContact | None:
        """The entry of the scene that allows two geoms to touch."""
        geom, other = self.split(pair)
        part, place = self.find_part(geom), self.find_place(other)
        if self.find_part(other):
            return None
        return next((rule for rule in self.site.task.contacts if (rule.part, rule.place) == (part, place)), None)


@dataclass(frozen=True, eq=False)
class Touches:
    """What the contacts of a log do to the arm at its T records.

    Attributes:
        forces: At the nodes, of tool and hubs, shape (T, N, 3), N.
        shares: At the near and the far hub of each member, of forces along it, shape (2, T, M, 3), N.
        lift: Upward on the mast, shape (T,), N.
        by_rule: Sums of the forces of each entry of the scene, shape (T, R, 3), N.
    """

    forces: Array
    shares: Array
    lift: Array
    by_rule: Array

    def total(self, ends: Index) -> Array:
        """All forces at the nodes, those of members too, whose ends have shape (M, 2); shape (T, N, 3), N."""
        total = self.forces.copy()
        for share, column in zip(self.shares, ends.T, strict=True):
            np.add.at(total.swapaxes(0, 1), column, share.swapaxes(0, 1))
        return total


def find_touches(site: Site, model: LoadModel, log: RunLog) -> Touches | None:
    """Put the logged forces of contacts and tool on nodes, members and mast; None where there was none at a record.

    A force on the tool is a wrench on the rigid plate. One on a member is shared between its hubs by moments about them; along
    the member it goes to the hub of its own segment.
    """
    rows, records = _match(log)
    if not len(rows) and not log.tool_force.any():
        return None
    parts, truss, rules = Parts(site), site.truss, site.task.contacts
    count = log.count
    forces, shares = np.zeros(log.nodes.shape), np.zeros((2, count, len(truss.members), 3))
    wrench, lift, by_rule = np.zeros((count, 6)), np.zeros(count), np.zeros((count, len(rules), 3))
    if log.tool_force.size:
        wrench[:, :3] = log.tool_force
    for row, record in zip(rows.tolist(), records.tolist(), strict=True):
        pair, force, point = log.contact_pair[row].tolist(), log.contact_force[row], log.contact_point[row]
        geom, _ = parts.split(pair)
        rule = parts.find_rule(pair)
        if rule is not None:
            by_rule[record, rules.index(rule)] += force
        part, node, segment = parts.find_part(geom), parts.find_node(geom), parts.find_segment(geom)
        if part == "tool":
            wrench[record, :3] += force
            wrench[record, 3:] += np.cross(point - log.tool_position[record], force)
        elif node is not None:
            forces[record, node] += force
        elif segment is not None:
            index, rod = segment
            shares[:, record, index] += _share(log.nodes[record, truss.ends[index]], force, point, rod=rod)
        elif part == "mast":
            lift[record] += force[2]
    forces += tool_forces(model, log.nodes, wrench)
    return Touches(forces, shares, lift, by_rule)


def _match(log: RunLog) -> tuple[Index, Index]:
    """Rows of contacts with a known force at the instant of a record, and those records."""
    time = log.contact_time
    if not len(time) or not log.contact_force.size or log.count < 2:
        return np.zeros(0, int), np.zeros(0, int)
    slack = _INSTANT * (log.time[1] - log.time[0])
    record = np.minimum(np.searchsorted(log.time, time - slack), log.count - 1)
    known = (np.abs(log.time[record] - time) <= slack) & np.isfinite(log.contact_force).all(axis=1)
    return np.flatnonzero(known), record[known]


def _share(ends: Array, force: Array, point: Array, *, rod: bool) -> Array:
    """Forces on the near and the far hub of a force at a point of a member between two places, shape (2, 3), N."""
    span = ends[1] - ends[0]
    length = np.linalg.norm(span)
    unit = span / length
    far = np.cross(np.cross(point - ends[0], force), unit) / length
    along = (force @ unit) * unit
    far += along if rod else 0.0
    return np.stack([force - far, far])
