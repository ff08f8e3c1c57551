"""Contacts of an arm that MuJoCo does not let touch anything, from the distances between its parts and the tank's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.plant.watch import Contact
from vgtsim.proximity import Proximity
from vgtsim.site import Site

Array = NDArray[np.float64]

# Of the least distance at a look, the way of the fastest hub along an axis until the next one: other parts may be twice as
# fast, and two of them may come to meet each other.
_SHARE = 0.25


class Lookout:
    """Measures distances whenever the arm has moved by a share of the least of them."""

    def __init__(self, site: Site) -> None:
        """Look at the first step."""
        self._near, self._room = Proximity(site), -np.inf
        self._coming = sorted(site.tank.appearances.values(), reverse=True)

    def look(self, time: float, nodes: Array, tool: Array, way: float, heights: Array | None = None) -> list[Contact]:
        """List what touches at a time, s.

        Nodes have shape (N, 3) and the tool point shape (3,), m; the way is that of the fastest hub in the last step, m. Heights,
        shape (P,), m, are those of waste that is cut: it falls, so what is far stays far.
        """
        self._room -= way
        while self._coming and self._coming[-1] <= time:
            self._room = -np.inf
            self._coming.pop()
        if self._room > 0:
            return []
        near = self._near
        around, (among, pair) = near.around(nodes, tool, heights), near.among(nodes, tool)
        around = near.leave_out(around, time)
        self._room = _SHARE * min(float(around.least), float(among))
        found = [
            Contact(time, near.name_around(int(part)), place, float(gap))
            for place, gap, part in zip(around.places, around.distance, around.body, strict=True)
            if gap <= 0
        ]
        if among <= 0:
            first, second = (near.name_among(int(part)) for part in pair)
            found.append(Contact(time, first, second, float(among)))
        return found
