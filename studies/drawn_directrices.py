"""Directrices drawn at random for an arm in a tank, and how well the arm follows them."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vgtsim.errors import PathError
from vgtsim.geometry import enclosure_distance, segment_distance
from vgtsim.kinematics.planar_arm import PlanarArm
from vgtsim.planning.directrices import least_radius
from vgtsim.planning.directrix import LeadCurve, make_directrix
from vgtsim.planning.insertion import Insertion, follow_directrix, make_guide
from vgtsim.site import Site

_ROOM = (
    0.25  # m about an arm as thick as the riser that a drawn curve has from everything: the arm leaves it by as much
)
FOLLOWED = 1.3  # deviation from the directrix over the least that a posture can have, which a way is held to
_SPACING = 0.02  # m: of the windows in which a straight section is laid along the curve
_TURN = np.radians(150.0)  # greatest of a curve: beyond it the arm comes back to its mast


@dataclass(frozen=True)
class Trial:
    """A curve, the way along it or the reason why there is none, and the processor time that was taken, s."""

    directrix: LeadCurve
    way: Insertion | None
    reason: str
    seconds: float


def draw_directrices(site: Site, count: int, seed: int) -> Iterator[tuple[LeadCurve, float]]:
    """Curves with one to three arcs, as sharp as the modules bend at the most, with room in the tank; and azimuths, rad.

    The straight part ends up to 1.5 m above or below what a stowed module under the rim leaves straight.
    """
    rng = np.random.default_rng(seed)
    found = 0
    while found < count:
        towards = float(rng.uniform(-np.pi, np.pi))
        guide = make_guide(site, make_directrix(6.0, [(1.0, 0.0)]), towards)
        planar = guide.planar
        sharpest = 1 / least_radius(planar, guide.least, guide.greatest)
        straight = guide.pivot + guide.opening[0] - planar.tops[0] - planar.stowed[0] - planar.static[1]
        foot = float(straight + rng.uniform(-1.5, 1.5))
        arcs = int(rng.integers(1, 4))
        sharp, sizes = sharpest * rng.uniform(0.2, 1.0, arcs), rng.uniform(1.5, 5.0, arcs)
        signs = np.where((np.arange(arcs) > 0) & (rng.uniform(size=arcs) < 0.3), -1.0, 1.0)
        curve = make_directrix(foot, list(zip(sizes.tolist(), (signs * sharp).tolist(), strict=True)))
        if np.abs(np.cumsum(sizes * signs * sharp)).max() < _TURN and _has_room(site, planar, curve):
            found += 1
            yield curve, towards


def _has_room(site: Site, planar: PlanarArm, curve: LeadCurve) -> bool:
    around, pivot = site.surroundings, site.scene.pivot_height
    flat, _ = curve.at(np.arange(0.0, planar.stowed_length - (pivot - curve.foot), 0.1))
    points = planar.place(flat)
    gaps = [
        enclosure_distance(site.tank, around.profile, points)[0].min(),
        points[:, 2].min() - around.obstacles.waste_level,
    ]
    for axis, thick in zip(around.obstacles.axes, around.obstacles.radii, strict=True):
        gaps.append(segment_distance(points[:-1], points[1:], axis[0], axis[1])[0].min() - thick)
    return min(gaps) > site.tank.arm_riser.bore / 2 + site.clearance + _ROOM


def follow_drawn(site: Site, count: int, seed: int) -> Iterator[Trial]:
    """Lead the arm along drawn curves; the deviation is held to `FOLLOWED` times the least that any posture can have."""
    for curve, towards in draw_directrices(site, count, seed):
        clock = time.process_time()
        try:
            way, reason = follow_directrix(site, curve, towards, followed=FOLLOWED), ""
        except PathError as error:
            way, reason = None, str(error)
        yield Trial(curve, way, reason, time.process_time() - clock)


def least_of_sections(site: Site, way: Insertion) -> float:
    """Least possible greatest distance, m, of the arm's straight sections alone from the directrix of a way."""
    planar = PlanarArm(site.chain, way.azimuth)
    sections = planar.static[1:] + planar.tool_offset * (np.arange(len(planar.stowed)) == len(planar.stowed) - 1)
    end = site.scene.pivot_height - planar.stowed_length  # height of the tool of the straight arm
    return least_offset(way.directrix, float(sections.max()), way.directrix.foot - end)


def least_offset(curve: LeadCurve, section: float, reach: float) -> float:
    """Least possible greatest distance, m, from a curve of a straight section that passes along it.

    The section, m, is moved from the foot until its end is at the arc length `reach`, m. On an arc of radius R it is
    section² / 16 R: half the height of the arc over the chord.
    """
    part = np.linspace(0.0, 1.0, 33)
    starts = np.arange(-section, max(reach - section, -section) + _SPACING, _SPACING)
    points, _ = curve.at(starts[:, None] + section * part)
    chord = points[:, -1] - points[:, 0]
    across = np.stack([-chord[:, 1], chord[:, 0]], axis=-1) / np.linalg.norm(chord, axis=-1, keepdims=True)
    away = np.einsum("wpk,wk->wp", points - points[:, :1], across)
    return float(np.max(np.ptp(away, axis=1)) / 2)
