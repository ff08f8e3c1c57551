"""Missions planned as a whole: one tour, or one for each phase of an arm that does not keep its length."""

from __future__ import annotations

from collections.abc import Sequence

from vgtsim.arrays import Array
from vgtsim.description import AddStep, begins_anew, list_phases
from vgtsim.planning.assembly import check_assembly_room, cut_way
from vgtsim.planning.checks import check_site
from vgtsim.planning.insertion import Insertion, plan_insertion
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
        DescriptionError: As in `plan_mission` and `check_assembly_room`; `PathError`, `ReachError`, `FollowError` likewise.
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
            tour, heights = carry_out(_lay(site, heights), ways[len(site.arm.active) - 1] if ways else None)
            tours.append(tour)
    return tuple(tours)


def _lay(site: Site, heights: Array | None) -> Site:
    """A site over waste of some heights in its diggings, shape (P,), m."""
    return site if heights is None else site.lower_waste(heights)


def _grow(sites: Sequence[Site], heights: Array | None) -> tuple[Insertion, ...]:
    """Ways in of an arm that grows from phase to phase, by the number of its modules less one; none of one that does not."""
    if not any(isinstance(step, AddStep) for site in sites for step in site.task.mission):
        return ()
    longest = _lay(max(sites, key=lambda site: len(site.arm.active)), heights)
    check_site(longest)
    check_assembly_room(longest)
    return cut_way(longest, plan_insertion(longest))
