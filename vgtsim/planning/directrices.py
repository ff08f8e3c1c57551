"""Which directrices an arm is tried on in a tank: straight down, an arc, and straight on towards the wall.

They are ranked by what can be told without a posture: room about the curve for an arm as thick as the riser is wide, and
how far the arm must leave the curve while all that is above the rim hangs straight.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vgtsim.arrays import Array
from vgtsim.geometry import enclosure_distance
from vgtsim.kinematics import PlanarArm, azimuth
from vgtsim.planning.directrix import LeadCurve, make_directrix
from vgtsim.planning.unfolding import make_opening
from vgtsim.site import Site

_AZIMUTHS = 12  # 30 degrees apart: a way between two of them is a little of both
# between planes whose bends are compared: modules of triangles bend most in every eighth of them
_BETWEEN = np.radians(15.0)
_SAME = 1e-6  # rad: rounding of the start's azimuth
# m of the foot above what a stowed module leaves straight
_RISE = np.array([0.0, 0.4, 0.8, 1.2, 1.6, 2.0, 2.4, -0.5, -1.0])
_CURVED = np.array([1.0, 1.1, 1.25, 1.45, 1.8])  # radius over the least that the modules can follow
_TURNS = np.radians([75.0, 90.0, 105.0, 120.0, 137.0])  # of the arc, from straight down: 90 degrees is level
_ENOUGH = 0.3  # m of room beyond which more is worth nothing
_BULGE = 0.07  # m that mid nodes of a bent module stand beyond the riser's radius
_SPACING = 0.25  # m between the points of a curve that are looked at
# share of the way that the arm leaves the curve by that it costs in room: what follows comes back to the curve
_BACK = 0.4
_APART = 0.01  # m of room that a radian away from the start's azimuth costs: of equal ways the nearest


def greatest_bend(planar: PlanarArm, least: Array, greatest: Array) -> float:
    """Bend, rad, that every active module reaches in the plane at some extension, inside the actuator lengths (J,), m."""
    bends, shares = np.radians(np.arange(0.0, 60.1, 1.0)), np.linspace(0.6, 1.1, 26)
    bend, share = (grid.ravel() for grid in np.meshgrid(bends, shares, indexing="ij"))
    count = len(planar.stowed)
    state = planar.chain.state(planar.inputs(np.tile(bend[:, None], count), share[:, None] * planar.stowed))
    inside = (state.lengths >= least) & (state.lengths <= greatest)
    found = np.inf
    for place in planar.chain.layout.places:
        for m, a in enumerate(place.active):
            legs = place.lengths[m][place.modules.actuated[m]]
            fits = (inside[:, legs].all(axis=1) & state.valid[:, a]).reshape(len(bends), -1).any(axis=1)
            found = min(found, float(bends[fits].max(initial=0.0)))
    return found


def least_radius(planar: PlanarArm, least: Array, greatest: Array) -> float:
    """Least radius, m, of an arc that the modules can follow: longest section and its module over their greatest bend."""
    longest = float(np.max(planar.static[1:] + 0.8 * planar.stowed))
    return longest / max(greatest_bend(planar, least, greatest), 1e-6)


def count_from(site: Site) -> tuple[float, ...]:
    """Azimuths from X of B_1, rad, that planes are counted from: that of the start, and the nearest of those that bend most.

    Errors are those of `PlanarArm`.
    """
    chain = site.chain
    start = azimuth(chain, chain.tool(site.start)[0])
    planes = np.arange(-np.pi, np.pi, _BETWEEN)
    bends = np.array([greatest_bend(PlanarArm(chain, towards), *_strokes(site)) for towards in planes])
    off = np.abs((planes - start + np.pi) % (2 * np.pi) - np.pi)
    best = np.lexsort((off, -bends))[0]
    return (start,) if off[best] < _SAME else (start, float(planes[best]))


def propose_directrices(site: Site, start: float | None = None) -> Iterator[tuple[LeadCurve, float]]:
    """Directrices and azimuths of their planes from X of B_1, rad, those with most room first.

    Planes are counted from an azimuth, rad, or from that of the site's start. Errors are those of `PlanarArm`.
    """
    chain, around = site.chain, site.surroundings
    start = azimuth(chain, chain.tool(site.start)[0]) if start is None else start
    planar = PlanarArm(chain, start)
    radius = least_radius(planar, *_strokes(site))
    rim = around.profile.rim(site.tank.arm_riser.bore / 2, site.tank.arm_riser.radius)
    opening = make_opening(planar, site.scene.pivot_height, 0.0)
    pitch = float(np.max(np.diff(opening, append=opening[-1] + planar.stowed[-1])))
    feet = rim - 0.1 - pitch + _RISE
    inside = float(0.95 * planar.stowed_length)
    turned = [PlanarArm(chain, float(start + 2 * np.pi * k / _AZIMUTHS)) for k in range(_AZIMUTHS)]
    found = []
    for foot in feet[(feet < rim - 0.3) & (feet > around.obstacles.waste_level)]:
        for bent in radius * _CURVED:
            for turn in _TURNS:
                curve = make_directrix(float(foot), [(float(bent * turn), float(1 / bent))])
                reach = inside - (site.scene.pivot_height - foot)
                for arm, room in zip(turned, _find_rooms(site, curve, turned, reach, rim - 0.1 - pitch), strict=True):
                    off = abs((arm.azimuth - start + np.pi) % (2 * np.pi) - np.pi)
                    found.append((min(room, _ENOUGH) - _APART * off, len(found), curve, arm.azimuth))
    found.sort(key=lambda item: (-item[0], item[1]))
    yield from _spread(found)


def _strokes(site: Site) -> tuple[Array, Array]:
    """Least and greatest actuator lengths of a way in, shape (J,), m: the stowed ones may have less than the margin."""
    stowed = site.chain.lengths(site.chain.stowed)
    return np.minimum(site.box.least, stowed), np.maximum(site.box.greatest, stowed)


def _spread(found: list[tuple[float, int, LeadCurve, float]]) -> Iterator[tuple[LeadCurve, float]]:
    """Curves in their order, but those with another foot or radius than all before come first: what is alike fails alike."""
    left = found
    while left:
        seen: set[tuple[float, float]] = set()
        later = []
        for item in left:
            key = item[2].foot, float(item[2].curvature[1])
            if key in seen:
                later.append(item)
                continue
            seen.add(key)
            yield item[2], item[3]
        left = later


def _find_rooms(site: Site, curve: LeadCurve, turned: list[PlanarArm], reach: float, straight: float) -> list[float]:
    """Room about a curve in the plane of each arm for a thick arm, less what leaving it costs, m."""
    around = site.surroundings
    flat, _ = curve.at(np.arange(0.0, max(reach, _SPACING), _SPACING))
    points = np.stack([arm.place(flat) for arm in turned])
    half = site.tank.arm_riser.bore / 2 + _BULGE + site.clearance
    bed, above = around.obstacles.bed, points[..., 2] - around.obstacles.waste_level
    if bed is not None and np.ptp(bed.heights) > 0:
        above = bed.distance(points)[0]
    walls = enclosure_distance(site.tank, around.profile, points)[0]
    least = np.minimum(walls.min(axis=1), above.min(axis=1))
    leave = abs(float(curve.offsets(np.array([0.0, straight]))[0]))
    things = [around.obstacles.distances(each[:-1], each[1:]).min(initial=np.inf) for each in points]
    return (np.minimum(least, things) - half - _BACK * leave).tolist()
