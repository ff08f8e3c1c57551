"""Whether an arm can come through its riser at all: checked before any way in is sought."""

from __future__ import annotations

from vgtsim.description import Feed, Tank
from vgtsim.kinematics import PlanarArm
from vgtsim.planning.checks import check_riser
from vgtsim.site import Site

ABOVE = 0.10  # m that the payload's ball is above the riser's flange at the beginning


def start_feed(site: Site, planar: PlanarArm) -> float:
    """Feed at which the payload of the stowed arm is above the riser's flange, m."""
    tank = site.tank
    flange = tank.grade + tank.arm_riser.above_grade
    return flange + ABOVE + site.task.payload.radius + planar.stowed_length - site.scene.pivot_height


def require_feed(site: Site) -> Feed:
    """The hoist of a scene.

    Raises:
        DescriptionError: There is none.
    """
    feed = site.task.mast.feed
    if feed is None:
        raise site.scene.error(
            "mast.feed", "nothing", "a table [mast.feed]: an arm comes in through the riser on a hoist"
        )
    return feed


def check_entry(site: Site) -> None:
    """Refuse a scene whose arm cannot come through the riser, whatever its way.

    Raises:
        DescriptionError: There is no hoist; the stowed arm does not pass the riser; something stands below the riser's mouth;
            the waste is above the pivot; the hoist or the headroom is too small to hold the arm above the riser.
    """
    require_feed(site)
    check_riser(site)
    check_mouth(site)
    check_hoist(site)


def check_hoist(site: Site) -> None:
    """Refuse a hoist or a headroom that is too small to hold the whole arm above the riser.

    Raises:
        DescriptionError: By how much.
    """
    scene, tank, feed = site.scene, site.tank, require_feed(site)
    first = start_feed(site, PlanarArm(site.chain, 0.0))
    if feed.stroke < first:
        short = f"{feed.stroke:.4g} m, {first - feed.stroke:.3g} m less than lifts the arm's tool out of the riser"
        raise scene.error("mast.feed.stroke", short, f"at least {first:.5g} m, or an arm that is assembled on site")
    if tank.headroom is not None:
        needed = scene.pivot_height + first + site.mast.length - tank.grade
        if tank.headroom < needed:
            short = f"{tank.headroom:.4g} m, {needed - tank.headroom:.3g} m less than arm and mast above the riser need"
            raise scene.error("tank.headroom", short, f"at least {needed:.5g} m, or an arm that is assembled on site")


def check_mouth(site: Site) -> None:
    """Refuse equipment below the riser's mouth, and waste that reaches the pivot.

    Raises:
        DescriptionError: With the equipment and how far it is in the way, or with the level and the pivot.
    """
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
