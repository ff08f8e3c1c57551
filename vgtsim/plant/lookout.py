"""Contacts of an arm that MuJoCo does not let touch anything, from the distances between its parts and the tank's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.plant.watch import Contact
from vgtsim.proximity import Proximity
from vgtsim.site import Site

Array = NDArray[np.float64]

_SHARE = 0.25  # of the least distance, which parts may travel between two looks: speeds may double, both may move
_LONGEST = 0.2  # s between two looks: an arm that stands may start
_SLOWEST = 0.01  # m/s; slower speeds give no longer times than this one


class Lookout:
    """Measures distances as often as speeds and distances ask for."""

    def __init__(self, site: Site) -> None:
        """Look at the first step."""
        self._proximity, self._next = Proximity(site), -np.inf

    def look(self, time: float, nodes: Array, tool: Array, speed: float) -> list[Contact]:
        """List what touches at a time, s.

        Nodes have shape (N, 3) and the tool point shape (3,), m; no part is faster than twice the speed, m/s.
        """
        if time < self._next:
            return []
        near = self._proximity
        around, (among, pair) = near.around(nodes, tool), near.among(nodes, tool)
        least = min(float(around.least), float(among))
        self._next = time + min(_SHARE * max(least, 0.0) / max(speed, _SLOWEST), _LONGEST)
        found = [
            Contact(time, near.name_around(int(part)), place, float(gap))
            for place, gap, part in zip(around.places, around.distance, around.body, strict=True)
            if gap <= 0
        ]
        if among <= 0:
            first, second = (near.name_among(int(part)) for part in pair)
            found.append(Contact(time, first, second, float(among)))
        return found
