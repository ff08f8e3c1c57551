"""The waste that was cut: no faster than the tool can, no farther than it reaches, and as much as its path and its rate say.

The volume is worked out anew from the logged tool, its share of power and the descriptions, by another way than the plant's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vgtsim.compilation import compiled
from vgtsim.description import CuttingTool
from vgtsim.geometry import Diggings
from vgtsim.site import Site
from vgtsim.verification.evidence import Array, Evidence
from vgtsim.verification.measures import Finding, missing, report_as, worst_of
from vgtsim.verification.tracking import measure_plan_error

_NAME = ("tool",)
_LEAST_VOLUME = 1e-6  # m³: errors are relative to this where next to nothing was removed
_HALVINGS = 60  # of the bounds of a layer's thickness: to the last digit


def cuts(site: Site) -> bool:
    """Whether the mission of a scene cuts waste."""
    return site.diggings is not None


def _diggings(run: Evidence) -> Diggings:
    assert run.site.diggings is not None  # the rows are for scenes that cut
    return run.site.diggings


def _tool(run: Evidence) -> CuttingTool:
    return _diggings(run).tool


def _lacks(run: Evidence) -> Finding | None:
    return None if run.log.bed.size else missing("the log has no waste that is cut", _NAME[0])


@report_as("actuator_speed", "waste removed a second over the tool's rate", limit="cutting_rate", applies=cuts)
def check_rate(run: Evidence) -> Finding:
    """Greatest rate at which waste went, by the bed between two records, over that of the tool at its share of power."""
    if lack := _lacks(run):
        return lack
    log, most = run.wide, _find_most(run)
    gone = np.diff(_volume(run, log.bed))
    with np.errstate(divide="ignore", invalid="ignore"):
        # rounding of heights: nothing goes with no power
        part = np.where(np.abs(gone) > 1e-15, np.abs(gone) / most, 0.0)
    return worst_of(part[:, None], log.time[1:], _NAME)


@report_as("record", "removed waste against the bed", limit="removed_volume", applies=cuts)
def check_balance(run: Evidence) -> Finding:
    """Greatest difference of the logged removed volume from that between the bed now and before, part of the whole."""
    if lack := _lacks(run):
        return lack
    volume = _volume(run, run.log.bed)
    error = np.abs(run.log.removed - volume) / max(volume[-1], _LEAST_VOLUME)
    return worst_of(error[:, None], run.log.time, _NAME)


@report_as("record", "removed waste against path and rate of the tool", limit="removed_volume", applies=cuts)
def check_removed(run: Evidence) -> Finding:
    """Greatest difference of the removed volume from that of the logged tool at its rate, part of the whole.

    The tool is followed from the first record on, over a bed of its own. The detail tells what was removed and what is left.
    """
    if lack := _lacks(run):
        return lack
    volume = _volume(run, run.log.bed)
    expected = volume[0] + _follow(run)
    error = np.abs(volume - expected) / max(volume[-1], _LEAST_VOLUME)
    found = worst_of(error[:, None], run.log.time, _NAME)
    return replace(found, summary=describe_removed(run))


@report_as("clearance", "waste removed beyond the tool's reach", limit="cutting_depth", applies=cuts)
def check_reach(run: Evidence) -> Finding:
    """How far a height that fell is outside the tool's spot, or lower than its reach, at most, m."""
    if lack := _lacks(run):
        return lack
    log, ground, tool = run.wide, _diggings(run), _tool(run)
    beyond = np.zeros(len(log.time) - 1)
    for k in np.flatnonzero((np.diff(log.bed, axis=0) != 0).any(axis=1)):
        fell = np.flatnonzero(log.bed[k] != log.bed[k + 1])
        first, last = log.tool_position[k], log.tool_position[k + 1]
        aside = _aside(ground.places[fell], first, last) - tool.width / 2 - ground.bed.spacing / 2
        deep = min(first[2], last[2]) - tool.reach - log.bed[k + 1, fell]
        beyond[k] = max(aside.max(), deep.max(), (ground.floor[fell] - log.bed[k + 1, fell]).max(), 0.0)
    return worst_of(beyond[:, None], log.time[1:], _NAME)


@report_as("axial_force", "tool force error over its rating", limit="axial_force_settled", applies=cuts)
def check_push(run: Evidence) -> Finding:
    """Greatest difference of the logged force of the tool from its reaction at its share of power, part of the whole."""
    if lack := _lacks(run):
        return lack
    push = _tool(run).push
    expected = run.log.tool_share[:, None] * np.array([0.0, 0.0, push])
    return worst_of(np.linalg.norm(run.log.tool_force - expected, axis=1)[:, None] / push, run.log.time, _NAME)


@report_as("tracking", "commanded tool to the plan", unit="1", limit="command", applies=cuts, planned=True)
def check_tool_plan(run: Evidence) -> Finding:
    """Greatest difference of the logged share of power from the planned one of its instant."""
    assert run.tour is not None  # the row is for reports with a plan
    if lack := _lacks(run):
        return lack
    shares = [(np.zeros(len(leg.lengths)) if leg.tool is None else leg.tool)[:, None] for leg in run.tour.legs]
    return worst_of(measure_plan_error(run, run.log.tool_share[:, None], shares), run.log.time, _NAME)


def describe_removed(run: Evidence) -> str:
    """What was removed until the end of some records, how heavy it is, how fast it went, and what is left, in words."""
    log, ground = run.log, _diggings(run)
    volume, step = float((ground.start - log.bed[-1]) @ ground.areas), float(np.diff(log.time).mean())
    whole = log.time[0] < step  # of a part of a run the volume is known, but not the time that it took
    working = step * float(np.sum(log.tool_share > 0)) if whole else 0.0
    hour = f", {3600 * float(np.ptp(log.removed)) / working:.3g} m³ an hour while the tool works" if working else ""
    left = float((log.bed[-1] - ground.floor) @ ground.areas)
    mass = volume * run.site.tank.waste.density
    return f"{volume:.4g} m³ removed, {mass:.4g} kg{hour}; {left:.4g} m³ left in the window about the patches"


def _volume(run: Evidence, bed: Array) -> Array:
    """Volume between the bed as described and logged heights, by prisms over the cells, shape (T,), m³."""
    ground = _diggings(run)
    return np.einsum("...p,p->...", ground.start - bed, ground.areas)


def _find_most(run: Evidence) -> Array:
    """Volume that the tool can remove between two records, shape (T - 1,), m³."""
    wide = run.wide
    share = np.maximum(wide.tool_share[1:], wide.tool_share[:-1])
    return _diggings(run).rate * share * np.diff(wide.time)


def _follow(run: Evidence) -> Array:
    """Volume that the tool removed since the first record by its path, its share of power and its rate, shape (T,), m³."""
    log, ground = run.log, _diggings(run)
    step = run.step
    heights, gone, total = log.bed[0].copy(), 0.0, np.zeros(len(log.time))
    for k in range(len(log.time) - 1):
        if log.tool_share[k] > 0 or log.tool_share[k + 1] > 0:
            span = log.time[k + 1] - log.time[k]
            count = max(round(float(span / step)), 1)
            for part in np.arange(count) / count:
                point = (1 - part) * log.tool_position[k] + part * log.tool_position[k + 1]
                share = (1 - part - 0.5 / count) * log.tool_share[k] + (part + 0.5 / count) * log.tool_share[k + 1]
                gone += _take(ground, heights, point, ground.rate * share * span / count)
        total[k + 1] = gone
    return total


def _take(ground: Diggings, heights: Array, point: Array, volume: float) -> float:
    """Lower heights by a layer under a tool point whose thickness is halved in on; returns the volume, m³."""
    tool, spacing = ground.tool, ground.bed.spacing
    away = np.hypot(ground.places[:, 0] - point[0], ground.places[:, 1] - point[1])
    under = np.minimum(np.maximum((tool.width / 2 + spacing / 2 - away) / spacing, 0.0), 1.0)
    room = np.maximum(heights - np.maximum(ground.floor, point[2] - tool.reach), 0.0) * (under > 0)
    thick = halve(ground.areas, under, room, volume)
    layer = np.minimum(thick * under, room)
    heights -= layer
    return float(np.sum(ground.areas * layer))


@compiled
def halve(areas: Array, under: Array, room: Array, volume: float) -> float:
    """Thickness, m, at which a layer has a volume, m³; where less is there, one at which all of it goes. Arrays are (P,)."""
    low, high, whole, some = 0.0, 0.0, 0.0, np.flatnonzero(under > 0)
    for p in some:
        high, whole = max(high, room[p] / under[p]), whole + areas[p] * room[p]
    for _ in range(_HALVINGS if whole > volume else 0):
        middle, held = (low + high) / 2, 0.0
        for p in some:
            held += areas[p] * min(middle * under[p], room[p])
        if held < volume:
            low = middle
        else:
            high = middle
    return high


def _aside(places: Array, first: Array, last: Array) -> Array:
    """Horizontal distance of places, shape (F, 2), m, from the way between two points, shape (3,), m."""
    way = (last - first)[:2]
    along = np.clip((places - first[:2]) @ way / max(float(way @ way), 1e-18), 0.0, 1.0)
    return np.linalg.norm(places - first[:2] - along[:, None] * way, axis=1)
