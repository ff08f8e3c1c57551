"""The way of an arm from above the riser into the tank: the mast is fed while the arm follows its leader along a directrix.

Feed h is the height of the mast above its working depth, m. Above the rim the arm is stowed. A module whose upper face has
passed the rim opens, and the axis of the arm follows the directrix in one vertical plane. Strokes, bore, clearances and
ratings are hard limits, held every two centimetres of feed. A withdrawal is an insertion backwards.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from vgtsim.arrays import Array
from vgtsim.errors import AssemblyError, PathError
from vgtsim.geometry import RISER
from vgtsim.kinematics import PlanarArm
from vgtsim.planning.checks import asked_spare
from vgtsim.planning.curve import reverse_spline
from vgtsim.planning.directrices import count_from, propose_directrices
from vgtsim.planning.directrix import LeadCurve, Leader
from vgtsim.planning.entry import Entry, require_feed, start_feed
from vgtsim.planning.postures import Postures, find_postures
from vgtsim.planning.smooth_shapes import Track, fit_shapes
from vgtsim.planning.timing import TimedPath, make_limits, time_feed
from vgtsim.planning.unfolding import Follower, Shapes, make_opening
from vgtsim.site import Site
from vgtsim.statics import find_use

if TYPE_CHECKING:
    from scipy.interpolate import BSpline


JUDGED = 0.02  # m of feed between the postures that are judged
BELOW = 0.10  # m that a module's upper face is below the rim before it opens
# part of the gap that the stowed arm is to have in the riser, that a way keeps: of 38 mm, 8 are left for sag
BORE = 0.8

_CURVES = 10  # directrices that are tried in either set of planes: about four seconds each
GRID = 0.025  # m of feed between the places that the splines of a way go through: fourteen in a knot
_STRAINED = 5  # every so many of the judged postures is held against the ratings: a decimetre apart
_OPENING = 1e-3  # m that an opening module may use beyond its stowed lengths, which have less than the usual margin
_LEAST_AIM = 1e-3  # m: a curve that is straight asks for no less
_KEPT = 1.5e-3  # m from the ends of strokes at which hinges begin
_SOFT = 0.02  # m beyond the clearance at which hinges begin
# Aim over the least deviation, and factor on the clearance's hinge: the next is tried while a limit is overrun.
_TRIES = ((1.1, 1.0), (0.95, 1.5), (1.4, 2.0), (2.2, 2.5))
# The same where the arm leaves its directrix too far just below the rim: a module unfolds sooner between finer knots, m.
_CLOSE, _CLOSE_KNOT = ((1.1, 1.0), (0.9, 1.0), (0.8, 1.25)), 0.12


@dataclass(frozen=True, eq=False)
class Insertion:
    """A way in, or out, over a parameter from 0 to 1; figures are the worst of all judged postures.

    Attributes:
        azimuth: Of the plane, from X of B_1, rad.
        spline: Inputs over the parameter, shape (n,) at each.
        feed: Height of the mast above its working depth over the parameter, m.
        gaps: Least distance from each place, m: `riser` for bore and rim, `the arm itself` with the mast.
        bore: Least distance of each module from bore and rim, shape (K,), m.
        deviation: Greatest distance of the axis from the directrix, m.
        bound: Least that any posture can have, at the feed where it is greatest, m; see `postures`.
        spare: Least distance of an actuator of an open module from the end of its stroke less the margin, m; where stowed
            lengths have less than the margin, from a millimetre beyond them.
        rest: The same at the end, from the full margin.
        strength: Greatest utilisation of a member at rest; `pressure` of the oil.
    """

    directrix: LeadCurve
    azimuth: float
    spline: BSpline
    feed: BSpline
    gaps: dict[str, float]
    bore: Array
    deviation: float
    bound: float
    spare: float
    rest: float
    strength: float
    pressure: float

    @property
    def ends(self) -> tuple[Array, Array]:
        """Inputs at the beginning and at the end, shape (n,) each."""
        return self.spline(0.0), self.spline(1.0)

    def reverse(self) -> Insertion:
        """The same way backwards."""
        return replace(self, spline=reverse_spline(self.spline), feed=reverse_spline(self.feed))


def plan_insertion(site: Site) -> Insertion:
    """Find the way of a site's arm from above the riser to a posture at its working depth; the same site gives the same way.

    Directrices are tried in the order of their room: in planes counted from that of the start, and then in those in which the
    modules bend most.

    Raises:
        DescriptionError: The arm does not stay in a plane.
        PathError: No directrix was found on which every limit is kept; the nearest miss is named.
    """
    missed: list[PathError] = []
    for towards in count_from(site):
        for directrix, azimuth in islice(propose_directrices(site, towards), _CURVES):
            try:
                return follow_directrix(site, directrix, azimuth)
            except PathError as error:
                missed.append(error)
    raise max(missed, key=lambda error: error.clearance)


def time_way(site: Site, way: Insertion) -> TimedPath:
    """A way in time, inside the rates of cylinders and feed of the scene; errors are those of `require_feed`."""
    motion, feed = site.task.motion, require_feed(site)
    limits = make_limits(site.chain, motion.rate_fraction, motion.acceleration)
    return time_feed(site.chain, way.spline, way.feed, limits, feed)


def make_leader(site: Site, way: Insertion) -> Leader:
    """The path of the leader of a way in."""
    mount = site.chain.mount
    level = mount[:3, :3] @ [np.cos(way.azimuth), np.sin(way.azimuth), 0.0]
    return Leader(way.directrix, mount[:3, 3] * [1.0, 1.0, 0.0], level, way.deviation, way.bound)


def make_guide(site: Site, directrix: LeadCurve, azimuth: float) -> Follower:
    """The arm of a site held to a directrix in the plane at an azimuth from X of B_1, rad; errors are those of `PlanarArm`."""
    planar = PlanarArm(site.chain, azimuth)
    rim = site.surroundings.profile.rim(site.tank.arm_riser.bore / 2, site.tank.arm_riser.radius)
    stowed = site.chain.lengths(site.chain.stowed)
    return Follower(
        planar=planar,
        directrix=directrix,
        pivot=site.scene.pivot_height,
        opening=make_opening(planar, site.scene.pivot_height, rim - BELOW),
        least=np.minimum(site.box.least, stowed - _OPENING),
        greatest=np.maximum(site.box.greatest, stowed + _OPENING),
    )


def follow_directrix(site: Site, directrix: LeadCurve, azimuth: float, followed: float = np.inf) -> Insertion:
    """Lead the arm of a site in along a directrix, in the plane at an azimuth from X of B_1, rad, to the working depth.

    `followed` is the greatest deviation over the least possible one.

    Raises:
        DescriptionError: The arm does not stay in a plane.
        PathError: A limit is overrun in every try; that of the best try is named.
    """
    guide = make_guide(site, directrix, azimuth)
    postures = find_postures(guide)
    tries = [(guide, *one) for one in _TRIES]
    if np.isfinite(followed):
        tries += [(replace(guide, knot=_CLOSE_KNOT), *one) for one in _CLOSE]
    best: tuple[float, str, float] | None = None
    unmade = ""
    for guide, aim, firm in tries:
        try:
            way = judge_way(site, guide, _fit(site, guide, postures, aim, firm), postures.bound)
        except AssemblyError as error:  # between the feeds at which the shapes were fitted
            unmade = unmade or f"the surroundings, but {error}"
            continue
        room, place, left = min(_rooms(site, way, followed))
        if room >= 0:
            return way
        if best is None or room > best[0]:
            best = room, place, left
    _, place, left = best or (0.0, unmade, -np.inf)
    raise PathError("the end of the insertion", left, place)


def _fit(site: Site, guide: Follower, postures: Postures, aim: float, firm: float) -> Shapes:
    track = Track(
        guide=guide,
        aim=max(aim * postures.bound, _LEAST_AIM),
        around=site.surroundings.unloaded,
        clearance=site.clearance + firm * _SOFT,
        kept=firm * _KEPT,
        mouth=guide.pivot + float(np.min(guide.opening - guide.planar.tops)) - BELOW,
    )
    return fit_shapes(track, postures)


def _rooms(site: Site, way: Insertion, followed: float) -> Iterator[tuple[float, str, float]]:
    """Room to each limit, in parts of it or in metres, its name, and the figure that an error gives, m."""
    for place, gap in way.gaps.items():
        yield gap - ask_gap(site, place), place, gap
    least = min(way.gaps.values())
    yield way.spare, f"the surroundings at the least, but overruns a stroke by {-way.spare:.4f} m", least
    yield way.rest, f"the surroundings at the least, but ends {-way.rest:.4f} m beyond a stroke less its margin", least
    worst = max(way.strength, way.pressure)
    yield 1 - worst, f"the surroundings at the least, but uses a member or its oil to {worst:.2f} of the rating", least
    off = f"the surroundings at the least, but leaves the directrix by {way.deviation:.3f} m; {way.bound:.3f} m must be"
    yield followed - way.deviation / max(way.bound, 1e-9), off, least


def ask_gap(site: Site, place: str) -> float:
    """Least distance that a way in keeps from a place, m."""
    return BORE * asked_spare(site) if place == RISER else site.clearance


def judge_again(site: Site, way: Insertion) -> Insertion:
    """A way in whose distances are measured anew, at a site where more is known of the tank than when it was found.

    Raises:
        PathError: It is not clear any more.
    """
    place = np.linspace(0.0, 1.0, int(np.ceil(abs(float(way.feed(0.0) - way.feed(1.0))) / JUDGED)) + 1)
    gaps = Entry(site).gaps(way.spline(place), way.feed(place)).least()
    room, name = min((gap - ask_gap(site, name), name) for name, gap in gaps.items())
    if room < 0:
        raise PathError("the riser", gaps[name], name)
    return replace(way, gaps=gaps)


def judge_way(site: Site, guide: Follower, shapes: Shapes, bound: float) -> Insertion:
    """Make splines of a way and measure them every two centimetres of feed.

    Raises:
        AssemblyError: A module does not assemble.
    """
    from scipy.interpolate import make_interp_spline  # slow to load, and only a way in needs it

    planar, first = guide.planar, start_feed(site, guide.planar)
    spread = np.linspace(0.0, 1.0, int(np.ceil(first / GRID)) + 1)
    heights = first - first * spread
    spline = make_interp_spline(spread, planar.inputs(*shapes(heights)), k=5)
    feed = make_interp_spline(spread, heights, k=5)
    place = np.linspace(0.0, 1.0, int(np.ceil(first / JUDGED)) + 1)
    h, q = feed(place), spline(place)
    length = site.chain.lengths(q)
    free = (h[:, None] < guide.opening)[:, guide.owner]
    spare = np.minimum(length - guide.least, guide.greatest - length)
    entry = Entry(site).gaps(q, h)
    used = find_use(site.case_model, site.sections, site.chain.nodes(q[::-_STRAINED]), site.safety_factor)
    off, _ = guide.axis(*shapes(h), h)
    return Insertion(
        directrix=guide.directrix,
        azimuth=planar.azimuth,
        spline=spline,
        feed=feed,
        gaps=entry.least(),
        bore=entry.bore.min(axis=0),
        deviation=float(np.abs(off).max()),
        bound=bound,
        spare=float(np.min(spare, where=free, initial=np.inf)),
        rest=float(np.min(site.box.spare(length[-1]), where=free[-1], initial=np.inf)),
        strength=float(used.strength.max()),
        pressure=float(used.pressure.max()),
    )
