"""The mast's feed and turn with their drives: did it go where it was sent, within its ratings, and under the headroom?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from vgtsim.description import Feed, Slew
from vgtsim.kinematics import axis_of
from vgtsim.site import Site
from vgtsim.verification.evidence import Array, Evidence
from vgtsim.verification.measures import Finding, Measure, absent, least_of, missing, report_as, worst_of
from vgtsim.verification.tracking import measure_plan_error

_LIFTED = 1e-3  # m of feed: a mast at its working depth leads no arm
_ALONG = np.linspace(0.0, 1.0, 7)[1:-1]  # places on each piece of the axis, besides its ends, that are measured
_BUFFER = 1e-3  # m that a hoist's end buffers give; servos sag by micrometres
_LEAST_FORCE = 1.0  # N, of a mast and an arm without weight


@dataclass(frozen=True)
class _Motion:
    """A motion of the mast by the word of its keys, the name and effort of its drive, and what an error of that is told over."""

    word: Literal["feed", "turn"]
    name_of_drive: str
    effort: str
    scale: str

    @property
    def name(self) -> tuple[str]:
        """Its place in the report."""
        return (f"mast/{self.word}",)

    def applies(self, site: Site) -> bool:
        """Whether the mast of a scene moves so."""
        return getattr(site.task.mast, self.word) is not None

    def is_stiff(self, site: Site) -> bool:
        """Whether it then goes where it is sent."""
        return self.applies(site) and site.task.simulation.drive != "servo"

    def drive(self, site: Site) -> Feed | Slew:
        """Its drive."""
        return getattr(site.task.mast, self.word)

    def arm(self, site: Site) -> float:
        """What makes metres of its places: 1 of a feed, of a turn the straight arm's length, which is the farthest out."""
        return (
            1.0 if self.word == "feed" else float(site.chain.mount[2, 3] - site.chain.tool(site.chain.straight)[0][2])
        )

    def lacks(self, run: Evidence) -> Finding | None:
        """That the log has nothing of it."""
        return None if getattr(run.log, self.word).size else missing(f"the log has no {self.word}", self.name[0])


_FEED = _Motion("feed", "hoist", "force", "force")
_TURN = _Motion("turn", "turning drive's", "torque", "mast's moment")
_MOTIONS = (_FEED, _TURN)
has_feed = _FEED.applies


def _report(
    check: str, quantity: str, *, stiff: bool = False, **words: Any
) -> Callable[[Callable[[_Motion, Evidence], Finding]], tuple[Measure, ...]]:
    """Make a row for each motion of the mast, with its words in the quantity; one that a servo would fail is `stiff`."""

    def make(find: Callable[[_Motion, Evidence], Finding]) -> tuple[Measure, ...]:
        return tuple(
            report_as(
                check, quantity.format(motion=motion), applies=motion.is_stiff if stiff else motion.applies, **words
            )(lambda run, motion=motion: motion.lacks(run) or find(motion, run))
            for motion in _MOTIONS
        )

    return make


def _has_rated_guide(site: Site) -> bool:
    return site.tank.guide is not None and site.tank.guide.force is not None


def is_inserted(site: Site) -> bool:
    """Whether the arm comes in through the riser."""
    return any(step.do == "insert" for step in site.task.mission)


def _has_headroom(site: Site) -> bool:
    return has_feed(site) and site.tank.headroom is not None


@_report("actuator_stroke", "distance to the end of the {motion.word}", limit="actuator_stroke", sense="at least")
def check_room(motion: _Motion, run: Evidence) -> Finding:
    """Least distance from the ends of the reach; a millimetre beyond is taken up by the buffers there."""
    low, high = motion.drive(run.site).range
    place = getattr(run.log, motion.word)
    room = np.minimum(place - low, high - place) * motion.arm(run.site)
    room[(room < 0) & (room >= -_BUFFER)] = 0.0
    return least_of(room[:, None], run.log.time, motion.name)


@_report("actuator_speed", "{motion.word} speed over rated speed", limit="actuator_speed")
def check_speed(motion: _Motion, run: Evidence) -> Finding:
    """Greatest speed over the rated one, from differences."""
    speed = np.abs(np.diff(getattr(run.wide, motion.word))) / np.diff(run.wide.time)
    return worst_of(speed[:, None] / motion.drive(run.site).rate, run.wide.time[1:], motion.name)


@_report("actuator_speed", "commanded {motion.word} acceleration over rated", limit="actuator_acceleration")
def check_acceleration(motion: _Motion, run: Evidence) -> Finding:
    """Greatest acceleration that was asked for, over the rated one, from differences."""
    step = run.wide.time[1] - run.wide.time[0]
    asked = getattr(run.wide, f"{motion.word}_commanded")
    part = np.abs(np.diff(asked, n=2)) / (step**2 * motion.drive(run.site).acceleration)
    return worst_of(part[:, None], run.wide.time[1:-1], motion.name)


@_report("tracking", "{motion.word} to its command", limit="command", stiff=True)
def check_command(motion: _Motion, run: Evidence) -> Finding:
    """Greatest distance of a place from its command; servos trail, and are judged at the goals."""
    off = getattr(run.log, motion.word) - getattr(run.log, f"{motion.word}_commanded")
    return worst_of(motion.arm(run.site) * np.abs(off)[:, None], run.log.time, motion.name)


@_report("tracking", "commanded {motion.word} to the plan", limit="command", planned=True)
def check_plan(motion: _Motion, run: Evidence) -> Finding:
    """Greatest distance of a logged command from the planned one of its instant."""
    assert run.tour is not None  # the row is for reports with a plan
    place, places = 0.0, []
    for leg in run.tour.legs:
        planned = getattr(leg, motion.word)
        places.append((np.full(len(leg.lengths), place) if planned is None else planned)[:, None])
        place = float(places[-1][-1, 0])
    found = measure_plan_error(run, getattr(run.log, f"{motion.word}_commanded")[:, None], places)
    return worst_of(motion.arm(run.site) * found, run.log.time, motion.name)


@report_as(
    "tracking", "axis from the leader's path over the planned", limit="leader", applies=is_inserted, planned=True
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


def _find_effort_error(motion: _Motion, run: Evidence, *, settled: bool) -> Finding:
    """Greatest error of the drive's effort against weight and inertia of mast and arm, over what there is of the instant."""
    rows, _ = run.expect(settled=settled)
    if not len(rows):
        return absent("the arm never settled")
    expected = expect_hoist(run, settled=settled) if motion is _FEED else expect_slew(run, settled=settled)
    scale = np.abs(expected) if motion is _FEED else np.linalg.norm(run.log.mast_reaction[rows, 3:], axis=1)
    error = np.abs(getattr(run.log, f"{motion.word}_{motion.effort}")[rows] - expected)
    return worst_of((error / np.maximum(scale, _LEAST_FORCE))[:, None], run.log.time[rows], motion.name)


_EFFORT = "{motion.name_of_drive} {motion.effort} error"
check_effort_at_rest = _report(
    "axial_force", _EFFORT + " at rest over the {motion.scale}", limit="axial_force_settled"
)(partial(_find_effort_error, settled=True))
check_effort = _report("axial_force", _EFFORT + " over the {motion.scale}", limit="axial_force_moving")(
    partial(_find_effort_error, settled=False)
)


def expect_hoist(run: Evidence, *, settled: bool) -> Array:
    """Force of the hoist from masses and motion, upward, of the settled records or of all, N."""
    rows, forces = run.expect(settled=settled)
    still = settled and not run.rings
    lift = np.zeros(len(rows)) if still else run.feed_acceleration[rows]
    touched = 0.0 if run.touches is None else run.touches.lift[rows]
    return forces.reaction[:, 2] - touched + run.site.mast.mass * (run.site.gravity + lift)


def expect_slew(run: Evidence, *, settled: bool) -> Array:
    """Torque of the drive that turns the mast, from masses and motion, of the settled records or of all, N·m.

    What touches the mast presses on its axis.
    """
    rows, forces = run.expect(settled=settled)
    still = settled and not run.rings
    spin = np.zeros(len(rows)) if still else run.turn_acceleration[rows]
    return forces.reaction[:, 5] + run.site.mast.axial_inertia * spin


@_report("actuator_force", "{motion.name_of_drive} {motion.effort} over rated {motion.effort}", limit="actuator_force")
def check_use(motion: _Motion, run: Evidence) -> Finding:
    """Greatest force or torque over the rated one."""
    effort = np.abs(getattr(run.log, f"{motion.word}_{motion.effort}"))
    return worst_of(effort[:, None] / getattr(motion.drive(run.site), motion.effort), run.log.time, motion.name)


@report_as("actuator_force", "guide force over rated force", limit="actuator_force", applies=_has_rated_guide)
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


@report_as("clearance", "headroom above the mast", limit="headroom", applies=_has_headroom, sense="at least")
def check_headroom(run: Evidence) -> Finding:
    """Least distance of the mast's top from the headroom, by the nodes that the mast holds."""
    tank, base = run.site.tank, run.log.nodes[:, run.site.truss.base, 2].mean(axis=1)
    assert tank.headroom is not None  # the row is for tanks with a headroom
    room = tank.grade + tank.headroom - base - run.site.mast.length
    return least_of(room[:, None], run.log.time, ("the mast's top",))
