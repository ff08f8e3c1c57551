"""How near an arm comes to the riser, tank, waste and itself while it is fed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array
from vgtsim.geometry import RISER
from vgtsim.proximity import Proximity
from vgtsim.site import Site


@dataclass(frozen=True)
class EntryGaps:
    """Least distances of W postures, m.

    Attributes:
        bore: Of each module from the bore and its rim, shape (W, K); infinite for modules that something else is nearest to.
        around: From shell, equipment and waste, shape (W, P); `places` names them. From uneven waste those that are not the
            least of the W may be less than they are.
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


@dataclass(frozen=True, eq=False)
class Entry:
    """Measures a site's arm in postures and at feeds."""

    site: Site

    @cached_property
    def _near(self) -> Proximity:
        return Proximity(self.site)

    def gaps(self, q: Array, feed: Array) -> EntryGaps:
        """Distances in postures of inputs, shape (W, n), at feeds, shape (W,), m.

        Raises:
            AssemblyError: A module does not assemble.
        """
        chain = self.site.chain
        nodes, tool = chain.nodes(q), chain.tool(q)[0]
        own, _ = self._near.among(nodes, tool)
        lift = np.stack([0 * feed, 0 * feed, feed], axis=-1)
        least, places = self._near.by_module(nodes + lift[:, None], tool + lift, together=True)
        rest = [p for p, name in enumerate(places) if name != RISER]
        return EntryGaps(
            bore=least[:, :, places.index(RISER)],
            around=least[:, :, rest].min(axis=1),
            places=tuple(places[p] for p in rest),
            own=own,
        )
