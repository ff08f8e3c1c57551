"""How near an arm comes to the riser, tank, waste and itself while it is fed, with cylinders by their real shape.

In the riser's bore the arm has some centimetres, so there a cylinder is a rod from end to end and a barrel from its eye to
its mouth, as in `riser_fit`; in the tank the same shape is used.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.geometry import arm_clearance
from vgtsim.geometry.clearance import RISER
from vgtsim.kinematics.inertia import member_radii
from vgtsim.proximity import Proximity
from vgtsim.site import Site

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True)
class EntryGaps:
    """Least distances of W postures, m.

    Attributes:
        bore: Of each module from the bore and its rim, shape (W, K); infinite for modules that something else is nearest to.
        around: From shell, equipment and waste, shape (W, P); `places` names them.
        own: Of the arm from itself and from the mast, shape (W,).
    """

    bore: Array
    around: Array
    places: tuple[str, ...]
    own: Array

    def least(self) -> dict[str, float]:
        """Least distance from each place, m; `riser` for the bore, `the arm itself` for arm and mast."""
        found = {RISER: float(self.bore.min()), "the arm itself": float(self.own.min())}
        return found | {name: float(gap) for name, gap in zip(self.places, self.around.min(axis=0), strict=True)}


@dataclass(frozen=True)
class _Part:
    """A module's points, and capsules between them: nodes by index, then barrels' eyes and mouths in pairs."""

    nodes: Index
    ends: Index
    radii: Array
    cylinders: Index
    eyes: Array
    mouths: Array


@dataclass(frozen=True, eq=False)
class Entry:
    """Measures a site's arm in postures and at feeds."""

    site: Site

    @cached_property
    def _parts(self) -> tuple[_Part, ...]:
        return tuple(self._part(k) for k in range(len(self.site.arm.modules)))

    def _part(self, k: int) -> _Part:
        arm, truss = self.site.arm, self.site.truss
        which = np.flatnonzero(truss.module == k)
        nodes = np.unique(np.concatenate([truss.ends[which].ravel(), np.flatnonzero(truss.node_module == k)]))
        radii = np.array(member_radii(arm, truss)[which])
        driven = np.array([truss.members[i].role == "actuator" for i in which])
        tubes = [arm.cylinders[truss.members[i].section] for i in which[driven]]
        barrels, radii[driven] = radii[driven], [tube.rod / 2 for tube in tubes]
        count, pairs = len(nodes), np.arange(2 * len(tubes)).reshape(-1, 2)
        return _Part(
            nodes=nodes,
            ends=np.concatenate([np.searchsorted(nodes, truss.ends[which]), count + pairs]),
            radii=np.concatenate([radii, barrels]),
            cylinders=truss.ends[which[driven]],
            eyes=np.array([tube.eye for tube in tubes]),
            mouths=np.array([tube.barrel_length for tube in tubes]),
        )

    def gaps(self, q: Array, feed: Array) -> EntryGaps:
        """Distances in postures of inputs, shape (W, n), at feeds, shape (W,), m.

        Raises:
            AssemblyError: A module does not assemble.
        """
        site, around = self.site, self.site.surroundings
        nodes, tool = site.chain.nodes(q), site.chain.tool(q)[0]
        own, _ = Proximity(site).among(nodes, tool)
        lift = np.stack([0 * feed, 0 * feed, feed], axis=-1)
        nodes, tool = nodes + lift[:, None], tool + lift
        found = []
        for k, part in enumerate(self._parts):
            points = np.concatenate([nodes[:, part.nodes], _barrels(part, nodes)], axis=1)
            ball = (tool, site.task.payload.radius) if k == len(self._parts) - 1 else None
            hub = site.arm.hub.radius
            found.append(
                arm_clearance(points, part.ends, part.radii, hub, site.tank, around.profile, around.obstacles, ball)
            )
        places = found[0].places
        least = np.stack([item.distance for item in found], axis=1)
        rest = [p for p, name in enumerate(places) if name != RISER]
        return EntryGaps(
            bore=least[:, :, places.index(RISER)],
            around=least[:, :, rest].min(axis=1),
            places=tuple(places[p] for p in rest),
            own=own,
        )


def _barrels(part: _Part, nodes: Array) -> Array:
    """Eye and mouth of each barrel, shape (W, 2 C, 3), m."""
    near, far = nodes[:, part.cylinders[:, 0]], nodes[:, part.cylinders[:, 1]]
    along = (far - near) / np.linalg.norm(far - near, axis=-1, keepdims=True)
    pairs = np.stack([near + part.eyes[:, None] * along, near + part.mouths[:, None] * along], axis=2)
    return pairs.reshape(len(nodes), -1, 3)
