"""An arm assembled on site: where the headroom is less than the arm, it grows module by module while it goes in.

A unit is an active module with the static sections below it. The part of the arm that is in the riser stands in the tank's
clamp over the riser's flange; the next unit is set on it; then mast and hoist lower all by the unit's length, and the clamp
takes the new upper face. All that is above the rim is stowed, so what hangs below a unit is at every height of the whole arm's
way in as it is with the units above it: the way is planned once, for the whole arm.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vgtsim.arrays import Array
from vgtsim.kinematics import PlanarArm
from vgtsim.planning.checks import check_riser
from vgtsim.planning.entry_checks import check_mouth, require_feed
from vgtsim.planning.insertion import GRID, Insertion
from vgtsim.site import Site


def unit_lengths(planar: PlanarArm) -> Array:
    """Length of each unit of the stowed arm, from the mast to the tool, shape (A,), m; the tool's offset belongs to the last."""
    lengths = planar.stowed + planar.static[1:]
    lengths[0] += planar.static[0]
    lengths[-1] += planar.tool_offset
    return lengths


def check_assembly_room(site: Site) -> None:
    """Refuse a tank in which the longest unit of an arm cannot be set on the part below it.

    Raises:
        DescriptionError: There is no hoist; a unit does not pass the riser; something stands below its mouth; the waste is above
            the pivot; or stroke or headroom are too small for a unit: by how much.
    """
    require_feed(site)
    check_riser(site)
    check_mouth(site)
    check_unit_room(site)


def check_unit_room(site: Site) -> None:
    """Refuse a hoist or a headroom that is too small to set the longest unit of an arm on the part in the clamp.

    Raises:
        DescriptionError: By how much.
    """
    scene, tank, feed = site.scene, site.tank, require_feed(site)
    longest = float(unit_lengths(PlanarArm(site.chain, 0.0)).max())
    top = tank.clamp_height + longest
    lift, needed = top - scene.pivot_height, top + site.mast.length - tank.grade
    what = f"the longest module of {site.arm.name}, {longest:.4g} m, needs above the clamp"
    if feed.stroke < lift:
        found = f"{feed.stroke:.4g} m, {lift - feed.stroke:.3g} m less than {what}"
        raise scene.error("mast.feed.stroke", found, f"at least {lift:.5g} m")
    if tank.headroom is not None and tank.headroom < needed:
        found = f"{tank.headroom:.4g} m, {needed - tank.headroom:.3g} m less than {what} with the mast on it"
        raise scene.error("tank.headroom", found, f"at least {needed:.5g} m")


def cut_way(site: Site, way: Insertion) -> tuple[Insertion, ...]:
    """Cut the way in of a whole arm into those of its parts, one for each unit, from the tool's to the mast's.

    Each begins with its unit set on the standing part, its upper face a unit above the clamp, and ends with that face in the
    clamp; the last ends with the way. The feed of a part is that of its own upper face. The distances are those of the whole
    arm's way, which are no greater.
    """
    from scipy.interpolate import make_interp_spline  # slow to load

    planar, owner = PlanarArm(site.chain, way.azimuth), site.chain.layout.owner
    clamp = site.tank.clamp_height - site.scene.pivot_height
    lengths, count = unit_lengths(planar), len(site.chain.layout.names)
    first, last = (float(way.feed(place)) for place in (0.0, 1.0))
    ways = []
    for a in range(count - 1, -1, -1):
        begin, end, sunk = clamp + float(lengths[a]), clamp if a else last, float(planar.tops[a]) if a else 0.0
        places = np.linspace(0.0, 1.0, int(np.ceil((begin - end) / GRID)) + 1)
        feeds = begin + (end - begin) * places
        whole = np.clip((feeds + sunk - first) / (last - first), 0.0, 1.0)  # a way's feed is even in its parameter
        part = replace(
            way,
            spline=make_interp_spline(places, way.spline(whole)[:, owner >= a], k=5),
            feed=make_interp_spline(places, feeds, k=5),
        )
        ways.append(part)
    return tuple(ways)
