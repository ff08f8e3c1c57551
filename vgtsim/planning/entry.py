"""Whether an arm can come through its riser at all, and how near it comes to riser, tank, waste and itself while it is fed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import Feed, Tank
from vgtsim.geometry import RISER
from vgtsim.kinematics import PlanarArm
from vgtsim.planning.checks import check_riser
from vgtsim.proximity import Proximity
from vgtsim.site import Site

ABOVE = 0.10  # m that the payload's ball is above the riser's flange at the beginning


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
        """Distances in postures of inputs, shape (W, n), at feeds, shape (W,), m; errors are those of `Chain.nodes`."""
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


def start_feed(site: Site, planar: PlanarArm) -> float:
    """Feed at which the payload of the stowed arm is above the riser's flange, m."""
    tank = site.tank
    flange = tank.grade + tank.arm_riser.above_grade
    return flange + ABOVE + site.task.payload.radius + planar.stowed_length - site.scene.pivot_height


def require_feed(site: Site) -> Feed:
    """The hoist of a scene; a `DescriptionError` where there is none."""
    feed = site.task.mast.feed
    if feed is None:
        raise site.scene.error(
            "mast.feed", "nothing", "a table [mast.feed]: an arm comes in through the riser on a hoist"
        )
    return feed


def check_entry(site: Site, *, grows: bool = False) -> None:
    """Refuse a scene whose arm cannot come through the riser, whatever its way, as a whole or `grows` unit by unit.

    Raises:
        DescriptionError: There is no hoist; the stowed arm does not pass the riser; something stands below the riser's mouth;
            the waste is above the pivot; the hoist or the headroom is too small, see `check_hoist`.
    """
    require_feed(site)
    check_riser(site)
    check_mouth(site)
    check_hoist(site, grows=grows)


def unit_lengths(planar: PlanarArm) -> Array:
    """Length of each unit of the stowed arm, from the mast to the tool, shape (A,), m; the tool's offset belongs to the last."""
    lengths = planar.stowed + planar.static[1:]
    lengths[0] += planar.static[0]
    lengths[-1] += planar.tool_offset
    return lengths


def check_hoist(site: Site, *, grows: bool = False) -> None:
    """Refuse a hoist or a headroom too small for the whole arm above the riser, or for its longest unit above the clamp.

    The `DescriptionError` says by how much.
    """
    scene, tank, feed = site.scene, site.tank, require_feed(site)
    planar = PlanarArm(site.chain, 0.0)
    if grows:
        longest = float(unit_lengths(planar).max())
        lift, otherwise = tank.clamp_height + longest - scene.pivot_height, ""
        what = f"the longest module of {site.arm.name}, {longest:.4g} m, needs above the clamp"
        for_stroke, for_headroom = what, f"{what} with the mast on it"
    else:
        lift, otherwise = start_feed(site, planar), ", or an arm that is assembled on site"
        for_stroke, for_headroom = "lifts the arm's tool out of the riser", "arm and mast above the riser need"
    if feed.stroke < lift:
        found = f"{feed.stroke:.4g} m, {lift - feed.stroke:.3g} m less than {for_stroke}"
        raise scene.error("mast.feed.stroke", found, f"at least {lift:.5g} m{otherwise}")
    needed = scene.pivot_height + lift + site.mast.length - tank.grade
    if tank.headroom is not None and tank.headroom < needed:
        found = f"{tank.headroom:.4g} m, {needed - tank.headroom:.3g} m less than {for_headroom}"
        raise scene.error("tank.headroom", found, f"at least {needed:.5g} m{otherwise}")


def check_mouth(site: Site) -> None:
    """Refuse equipment below the riser's mouth, and waste that reaches the pivot; the `DescriptionError` says by how much."""
    scene, tank = site.scene, site.tank
    riser, around = tank.arm_riser, site.surroundings.obstacles
    column = [*riser.place, tank.waste.level], [*riser.place, site.surroundings.profile.crown]
    for name, gap in zip(around.names, around.distances(*column).tolist(), strict=True):
        inside = riser.bore / 2 - gap
        if inside > 0:
            found = f"{name}, {inside:.3f} m inside the cylinder below the mouth of {riser.name}"
            allowed = f"{inside:.4g} m farther from the riser's axis: the arm comes down there"
            raise scene.error(_find_key(tank, name), found, allowed)
    level, pivot = tank.waste.level, scene.pivot_height
    if level >= pivot:
        found = f"{level:.4g} m, {level - pivot:.3g} m above the arm's pivot at z = {pivot:.4g} m"
        raise scene.error("tank.waste.level", found, f"below {pivot:.4g} m: the arm works below its pivot")


def _find_key(tank: Tank, name: str) -> str:
    """Key of the table that a named thing stands in."""
    tables = {"equipment": tank.equipment, "boxes": tank.boxes, "meshes": tank.meshes}
    places = [(f"tank.{key}.{k}", entry) for key, entries in tables.items() for k, entry in enumerate(entries)]
    return next(place for place, entry in places if name in [single.name for single in entry.ring])
