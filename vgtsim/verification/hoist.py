"""The mast's feed and its hoist: did it go where it was sent, within its ratings, and under the headroom?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vgtsim.description import Feed
from vgtsim.kinematics import axis_of
from vgtsim.site import Site
from vgtsim.verification.evidence import Array, Evidence
from vgtsim.verification.measures import Finding, absent, least_of, missing, report_as, worst_of
from vgtsim.verification.tracking import measure_plan_error

_NAME = ("mast/feed",)
_LIFTED = 1e-3  # m of feed: a mast at its working depth leads no arm
_ALONG = np.linspace(0.0, 1.0, 7)[1:-1]  # places on each piece of the axis, besides its ends, that are measured
_BUFFER = 1e-3  # m that a hoist's end buffers give; servos sag by micrometres
_LEAST_FORCE = 1.0  # N, of a mast and an arm without weight


def has_feed(site: Site) -> bool:
    """Whether the mast of a scene moves."""
    return site.task.mast.feed is not None


def _has_rated_guide(site: Site) -> bool:
    return site.tank.guide is not None and site.tank.guide.force is not None


def _has_stiff_feed(site: Site) -> bool:
    return has_feed(site) and site.task.simulation.drive != "servo"


def is_inserted(site: Site) -> bool:
    """Whether the arm comes in through the riser."""
    return any(step.do == "insert" for step in site.task.mission)


def _has_headroom(site: Site) -> bool:
    return has_feed(site) and site.tank.headroom is not None


def _hoist(run: Evidence) -> Feed:
    feed = run.site.task.mast.feed
    assert feed is not None  # the rows are for scenes with a feed
    return feed


def _lacks_feed(run: Evidence) -> Finding | None:
    return None if run.log.feed.size else missing("the log has no feed", _NAME[0])


@report_as(
    "actuator_stroke",
    "distance to the end of the feed",
    unit="m",
    limit="actuator_stroke",
    applies=has_feed,
    sense="at least",
)
def check_feed_room(run: Evidence) -> Finding:
    """Least distance of the feed from the ends of its stroke; a millimetre beyond is taken up by the buffers there."""
    room = np.minimum(run.log.height, _hoist(run).stroke - run.log.height)
    room[(room < 0) & (room >= -_BUFFER)] = 0.0
    return _lacks_feed(run) or least_of(room[:, None], run.log.time, _NAME)


@report_as("actuator_speed", "feed speed over rated speed", unit="1", limit="actuator_speed", applies=has_feed)
def check_feed_speed(run: Evidence) -> Finding:
    """Greatest speed of the feed over its rated one, from differences."""
    speed = np.abs(np.diff(run.wide.height)) / np.diff(run.wide.time)
    return _lacks_feed(run) or worst_of(speed[:, None] / _hoist(run).rate, run.wide.time[1:], _NAME)


@report_as(
    "actuator_speed",
    "commanded feed acceleration over rated",
    unit="1",
    limit="actuator_acceleration",
    applies=has_feed,
)
def check_feed_acceleration(run: Evidence) -> Finding:
    """Greatest acceleration that the feed was asked for, over its rated one, from differences."""
    if lack := _lacks_feed(run):
        return lack
    step = run.wide.time[1] - run.wide.time[0]
    part = np.abs(np.diff(run.wide.feed_commanded, n=2)) / (step**2 * _hoist(run).acceleration)
    return worst_of(part[:, None], run.wide.time[1:-1], _NAME)


@report_as("tracking", "feed to its command", unit="m", limit="command", applies=_has_stiff_feed)
def check_feed(run: Evidence) -> Finding:
    """Greatest distance of the feed from its command; servos trail, and are judged at the goals."""
    return _lacks_feed(run) or worst_of(np.abs(run.log.height - run.log.feed_commanded)[:, None], run.log.time, _NAME)


@report_as("tracking", "commanded feed to the plan", unit="m", limit="command", applies=has_feed, planned=True)
def check_feed_plan(run: Evidence) -> Finding:
    """Greatest distance of a logged command of the feed from the planned one of its instant."""
    assert run.tour is not None  # the row is for reports with a plan
    if lack := _lacks_feed(run):
        return lack
    height, feeds = 0.0, []
    for leg in run.tour.legs:
        feeds.append((np.full(len(leg.lengths), height) if leg.feed is None else leg.feed)[:, None])
        height = float(feeds[-1][-1, 0])
    return worst_of(measure_plan_error(run, run.log.feed_commanded[:, None], feeds), run.log.time, _NAME)


@report_as(
    "tracking",
    "axis from the leader's path over the planned",
    unit="1",
    limit="leader",
    applies=is_inserted,
    planned=True,
)
def check_leader(run: Evidence) -> Finding:
    """Greatest distance of the axis from the path of the leader on the way in and out, over the greatest planned one.

    The axis runs through the middles of the faces to the tool.
    """
    assert run.tour is not None  # the row is for reports with a plan
    found, chain = [], run.site.chain
    axis = np.concatenate([axis_of(chain, run.log.nodes), run.tool[0][:, None]], axis=1)[:, 1:]
    names = (*(module.name for module in run.site.arm.modules), "tool")
    for leg in run.tour.legs:
        rows = np.flatnonzero((run.log.goal == leg.goal) & (run.log.height > _LIFTED))
        if leg.leader is None or not len(rows):
            continue
        between = axis[rows, :-1, None] + _ALONG[:, None] * (axis[rows, 1:] - axis[rows, :-1])[:, :, None]
        off = leg.leader.measure(axis[rows])
        off[:, 1:] = np.maximum(off[:, 1:], leg.leader.measure(between).max(axis=-1))
        worst = worst_of(off / leg.leader.deviation, run.log.time[rows], names)
        bound = (
            f"{worst.value * leg.leader.deviation:.3f} m; the least that a posture can have is {leg.leader.bound:.3f} m"
        )
        found.append(replace(worst, detail=bound))
    return max(found, key=lambda item: item.value) if found else absent("the arm was on no way in or out")


@report_as(
    "axial_force", "hoist force error at rest over the force", unit="1", limit="axial_force_settled", applies=has_feed
)
def check_hoist_at_rest(run: Evidence) -> Finding:
    """As `check_hoist`, for the settled records."""
    return _find_hoist_error(run, settled=True)


@report_as("axial_force", "hoist force error over the force", unit="1", limit="axial_force_moving", applies=has_feed)
def check_hoist(run: Evidence) -> Finding:
    """Greatest error of the hoist's force against weight and inertia of mast and arm, over the force of the instant."""
    return _find_hoist_error(run, settled=False)


def _find_hoist_error(run: Evidence, *, settled: bool) -> Finding:
    if lack := _lacks_feed(run):
        return lack
    rows, _ = run.expect(settled=settled)
    if not len(rows):
        return absent("the arm never settled")
    expected = expect_hoist(run, settled=settled)
    error = np.abs(run.log.feed_force[rows] - expected) / np.maximum(np.abs(expected), _LEAST_FORCE)
    return worst_of(error[:, None], run.log.time[rows], _NAME)


def expect_hoist(run: Evidence, *, settled: bool) -> Array:
    """Force of the hoist from masses and motion, upward, of the settled records or of all, N."""
    rows, forces = run.expect(settled=settled)
    still = settled and not run.rings
    lift = np.zeros(len(rows)) if still else run.feed_acceleration[rows]
    touched = 0.0 if run.touches is None else run.touches.lift[rows]
    return forces.reaction[:, 2] - touched + run.site.mast.mass * (run.site.gravity + lift)


@report_as("actuator_force", "hoist force over rated force", unit="1", limit="actuator_force", applies=has_feed)
def check_hoist_use(run: Evidence) -> Finding:
    """Greatest force of the hoist over its rated one."""
    return _lacks_feed(run) or worst_of(np.abs(run.log.feed_force)[:, None] / _hoist(run).force, run.log.time, _NAME)


@report_as("actuator_force", "guide force over rated force", unit="1", limit="actuator_force", applies=_has_rated_guide)
def check_guide(run: Evidence) -> Finding:
    """Greatest force of a ring of rollers over its rated one, while the mast is between both rings."""
    guide = run.site.tank.guide
    assert guide is not None  # the row is for tanks with a guide
    assert guide.force is not None
    force = np.linalg.norm(find_guide_forces(run), axis=-1)
    held = np.isfinite(force).all(axis=1)
    found = worst_of(
        np.where(held[:, None], force, 0.0) / guide.force, run.log.time, (guide.name, f"{guide.name}, upper")
    )
    return replace(found, detail=f"the mast stands between the rings in {held.mean():.1%} of the records")


def find_guide_forces(run: Evidence) -> Array:
    """Forces of the lower and the upper ring of rollers on the mast, shape (T, 2, 2), N, along x and y of frame G.

    NaN while the mast is not between both rings.
    """
    tank, log, guide = run.site.tank, run.log, run.site.tank.guide
    assert guide is not None
    bottom = run.site.scene.pivot_height + log.height
    low, high = (tank.grade + place - bottom for place in (guide.lower, guide.upper))
    force, moment = -log.mast_reaction[:, :2], -log.mast_reaction[:, 3:5]
    lever = np.stack([-moment[:, 1], moment[:, 0]], axis=-1)  # what the rings must make up: sum of height times force
    upper = (lever + low[:, None] * force) / (high - low)[:, None]
    found = np.stack([-force - upper, upper], axis=1)
    found[(low < 0) | (high > run.site.mast.length)] = np.nan
    return found


@report_as("clearance", "headroom above the mast", unit="m", limit="headroom", applies=_has_headroom, sense="at least")
def check_headroom(run: Evidence) -> Finding:
    """Least distance of the mast's top from the headroom, by the nodes that the mast holds."""
    tank, base = run.site.tank, run.log.nodes[:, run.site.truss.base, 2].mean(axis=1)
    assert tank.headroom is not None  # the row is for tanks with a headroom
    room = tank.grade + tank.headroom - base - run.site.mast.length
    return least_of(room[:, None], run.log.time, ("the mast's top",))
