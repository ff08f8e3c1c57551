"""Contacts of an arm that MuJoCo does not let touch anything, from the distances between its parts and the tank's."""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array
from vgtsim.plant.watch import Contact
from vgtsim.proximity import Proximity
from vgtsim.site import Site

# Of the least distance at a look, that a point of `Proximity.points` may have moved since; of two parts each goes its way. So
# nothing has touched anything before the next look. A quarter is left for distances from the riser's mouth, which are found to
# a thousandth of a member's length.
_SHARE = 3 / 4


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
        self._room = _SHARE * min(float(around.least), float(among) / 2)
        found = [
            Contact(time, near.name_around(int(part)), place, float(gap))
            for place, gap, part in zip(around.places, around.distance, around.body, strict=True)
            if gap <= 0
        ]
        if among <= 0:
            first, second = (near.name_among(int(part)) for part in pair)
            found.append(Contact(time, first, second, float(among)))
        return found
