"""Missions planned as a whole: one tour, or one for each phase of an arm that does not keep its length.

Where the headroom is less than the arm, it is assembled on site: it grows module by module while it goes in. A unit is an active
module with the static sections below it. The part of the arm that is in the riser stands in the tank's clamp over the riser's
flange; the next unit is set on it; then mast and hoist lower all by the unit's length, and the clamp takes the new upper face.
All that is above the rim is stowed, so what hangs below a unit is at every height of the whole arm's way in as it is with the
units above it: the way is planned once, for the whole arm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import AddStep, begins_anew, list_phases
from vgtsim.kinematics import PlanarArm
from vgtsim.planning.checks import check_site
from vgtsim.planning.entry import check_entry, unit_lengths
from vgtsim.planning.insertion import GRID, Insertion, plan_insertion
from vgtsim.planning.mission import carry_out, plan_mission
from vgtsim.planning.tour import Tour, plan_tour
from vgtsim.site import Site


def plan_site(site: Site) -> Tour:
    """Plan what a scene asks for: its mission, or the tour of its goals; see `plan_mission` and `plan_tour`.

    Raises:
        DescriptionError: The mission is one in phases, see `plan_phases`, or another reason of those two.
    """
    if not site.task.mission:
        return plan_tour(site)
    phases = list_phases(site.scene)
    if site.scene not in phases:
        found = f"a mission in {len(phases)} phases, as the arm does not keep its length"
        raise site.scene.error("mission", found, "a plan for each: vgtsim.planning.plan_phases")
    return plan_mission(site)


def plan_phases(sites: Sequence[Site]) -> tuple[Tour, ...]:
    """Plan all phases of a mission, see `list_phases`: a tour for each, of which the next begins as the one before ended.

    An arm that grows in the riser has one way in, that of its longest phase. Each phase is planned over the waste that those
    before it will leave.

    Raises:
        DescriptionError: As in `plan_mission` and `check_entry`; `PathError`, `ReachError`, `FollowError` likewise.
    """
    if len(sites) == 1 and sites[0].task.phase is None:
        return (plan_site(sites[0]),)
    campaigns: list[list[Site]] = []
    for site in sites:
        if begins_anew(site.scene) or not campaigns:
            campaigns.append([])
        campaigns[-1].append(site)
    tours: list[Tour] = []
    heights = sites[0].begun
    for campaign in campaigns:
        ways = _grow(campaign, heights)
        for site in campaign:
            tour, heights = carry_out(site.lower_waste(heights), ways[len(site.arm.active) - 1] if ways else None)
            tours.append(tour)
    return tuple(tours)


def _grow(sites: Sequence[Site], heights: Array | None) -> tuple[Insertion, ...]:
    """Ways in of an arm that grows from phase to phase, by the number of its modules less one; none of one that does not."""
    if not any(isinstance(step, AddStep) for site in sites for step in site.task.mission):
        return ()
    longest = max(sites, key=lambda site: len(site.arm.active)).lower_waste(heights)
    check_site(longest)
    check_entry(longest, grows=True)
    return cut_way(longest, plan_insertion(longest))


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
