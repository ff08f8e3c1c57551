"""Rows of a tool over waste: where they run, how fast, and what they leave of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array, Mask
from vgtsim.description import CutStep, CuttingTool, Patch, RasterPiece, ToolPath
from vgtsim.geometry import Diggings, make_profile
from vgtsim.site import Site

_LOOKED = 41  # points of a row between whose sweeps no height is left out: a tenth of a usual spot's width
_LEAST = 1e-3  # m/s: a slower tool would stand still


@dataclass(frozen=True, eq=False)
class CutPlan:
    """A step that cuts: level rows of the tool point at a height over the waste, cut down to a bottom, m."""

    step: CutStep
    patch: Patch
    tool: CuttingTool
    bottom: float
    speed: float

    @property
    def height(self) -> float:
        """Of the tool point while it cuts, m."""
        return self.bottom + self.tool.reach

    @property
    def middle(self) -> Array:
        """Tool point over the middle of the patch, shape (3,), m."""
        return np.array([*np.mean(self.patch.corners, axis=0), self.height])

    def make_path(self, direction: Array, rate_fraction: float, acceleration: float) -> ToolPath:
        """The rows as a tool path with a direction, shape (3,)."""
        (x, y), patch = self.patch.corner, self.patch
        rows = RasterPiece(shape="raster", width=(*patch.along, 0.0), depth=(*patch.across, 0.0), rows=self.step.rows)
        return ToolPath(
            name="cut",
            start=(x, y, self.height),
            direction=tuple(direction.tolist()),
            tolerance=self.step.tolerance,
            rate_fraction=rate_fraction,
            acceleration=acceleration,
            speed=self.speed,
            pieces=(rows,),
        )

    def add_rests(self, lengths: Array, timestep: float) -> tuple[Array, Array]:
        """Lengths with rests at both ends, in which the tool comes to power and to rest, shape (T, J); and its share, (T,)."""
        rise = rise_to_power(self.tool, timestep)[:-1]
        share = np.concatenate([rise, np.ones(len(lengths)), rise[::-1]])
        rest = np.ones((len(rise), 1))
        return np.concatenate([rest * lengths[0], lengths, rest * lengths[-1]]), share


def rise_to_power(tool: CuttingTool, timestep: float) -> Array:
    """Shares of a tool's power in which it starts, from none to all, at steps of some s, shape (T,)."""
    count = max(int(np.ceil(tool.ramp / timestep)), 1)
    part = np.arange(count + 1) / count
    return part**2 * (3 - 2 * part)


def plan_cut(site: Site, index: int, step: CutStep, heights: Array) -> CutPlan:
    """Find height and speed of a step's rows over waste of some heights in the site's diggings, shape (P,), m.

    Raises:
        DescriptionError: The layer is deeper than the waste, or so deep that the tool could not keep clear of it; the patch is
            not inside the tank; or the tool would have to creep.
    """
    diggings, tool = _require(site), site.task.tool
    assert tool is not None  # there would be no diggings
    patch = next(item for item in site.task.patches if item.name == step.patch)
    key, error = f"mission.{index}", site.scene.error
    swept = _sweep(diggings, patch, step.rows)
    top, floor = float(heights[swept].max()), float(diggings.floor[swept].max())
    bottom = top - step.depth
    if bottom < floor - 1e-9:  # rounding of figures such as "145 mm"
        found = f"{step.depth:.4g} m, deeper than the waste: {top - floor:.3f} m of it over the floor of {patch.name}"
        raise error(f"{key}.depth", found, f"at most {top - floor:.4f} m")
    room = tool.reach - site.task.payload.radius - site.clearance
    if step.depth > room:
        found = f"{step.depth:.4g} m with a tool that reaches {tool.reach:.4g} m below its point"
        allowed = f"at most {room:.4g} m: the reach less payload radius and clearance, or a cut in several layers"
        raise error(f"{key}.depth", found, allowed)
    widest = float(make_profile(site.tank.shell).radius_at(bottom)) - tool.width / 2
    farthest = float(np.max(np.hypot(*np.transpose(patch.corners))))
    if farthest > widest:
        found = f"{patch.name}, which comes to {farthest:.3f} m from the tank's axis"
        raise error(f"{key}.patch", found, f"at most {widest:.3f} m, so that the tool cuts inside the wall")
    pitch = abs(np.linalg.det([patch.along, patch.across])) / float(np.hypot(*patch.along)) / (step.rows - 1)
    speed = step.speed or diggings.rate / (min(pitch, tool.width) * step.depth)
    if speed < _LEAST:
        found = f"{step.depth:.4g} m at {diggings.rate * 3600:.3g} m³ an hour: rows at {speed * 1e3:.3g} mm/s"
        raise error(f"{key}.depth", found, f"rows at {_LEAST * 1e3:g} mm/s or more: a thinner layer or more rows")
    return CutPlan(step=step, patch=patch, tool=tool, bottom=bottom, speed=speed)


def check_cuts(site: Site) -> None:
    """Refuse steps that cannot cut, as if each step before removed its whole layer; errors are those of `plan_cut`."""
    if site.diggings is None or site.begun is None:
        return
    heights = site.begun.copy()
    for index, step in enumerate(site.task.mission):
        if isinstance(step, CutStep):
            plan = plan_cut(site, index, step, heights)
            swept = _sweep(site.diggings, plan.patch, step.rows)
            heights[swept] = np.minimum(heights[swept], np.maximum(plan.bottom, site.diggings.floor[swept]))


def foresee_cut(site: Site, lengths: Array, share: Array, timestep: float, heights: Array) -> Array:
    """Heights that the tool will leave, shape (P,), m, from lengths, shape (T, J), m, and its share of power, shape (T,)."""
    return foresee_waste(site, site.chain.tool(site.chain.inputs_from_lengths(lengths))[0], share, timestep, heights)


def foresee_waste(site: Site, points: Array, share: Array, timestep: float, heights: Array) -> Array:
    """As `foresee_cut`, from tool points, shape (T, 3), m."""
    diggings, left = _require(site), heights.copy()
    for point, part in zip(points[:-1], (share[1:] + share[:-1]) / 2, strict=True):
        diggings.dig(left, point, diggings.rate * timestep * float(part))
    return left


def _require(site: Site) -> Diggings:
    assert site.diggings is not None  # a scene with such a step has them
    return site.diggings


def _sweep(diggings: Diggings, patch: Patch, rows: int) -> Mask:
    """Which heights the tool covers on its rows over a patch, shape (P,)."""
    a, b = np.meshgrid(np.linspace(0, 1, _LOOKED), np.linspace(0, 1, rows))
    points = np.array(patch.corner) + a.reshape(-1, 1) * patch.along + b.reshape(-1, 1) * patch.across
    return np.any([diggings.cover(point) > 0 for point in points], axis=0)
