"""The surface of the waste: level, or a grid of heights with mounds; and what is cut away of it, never more than is there."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.compilation import by_rows, compiled
from vgtsim.description import CuttingTool, Patch, Tank
from vgtsim.geometry import surface
from vgtsim.geometry.profile import Profile, make_profile

SPACING = 0.2  # m between heights, a quarter of the least foot of a mound
_PARTS = 8  # parts a side of a cell, by which the area inside the wall is counted


@dataclass(frozen=True, eq=False)
class Bed:
    """Heights over the square about a tank, shape (n, n), m, at x and y from `corner` on, `spacing` apart; the order is [x, y].

    Waste ends at the wall, of a radius in m: `areas` are those that each height stands for inside it, shape (n, n), m².
    """

    heights: Array
    corner: float
    spacing: float
    radius: float

    @cached_property
    def ground(self) -> Array:
        """Corner, spacing, greatest and least height, m, and cosine of the steepest slope, for compiled functions, shape (5,)."""
        x, y = np.diff(self.heights, axis=0) / self.spacing, np.diff(self.heights, axis=1) / self.spacing
        # of both triangles of each cell
        steep = max((x[:, :-1] ** 2 + y[1:] ** 2).max(), (x[:, 1:] ** 2 + y[:-1] ** 2).max())
        return np.array([self.corner, self.spacing, self.heights.max(), self.heights.min(), 1 / np.sqrt(1 + steep)])

    @property
    def places(self) -> Array:
        """X and y of each height, shape (n, n, 2), m."""
        line: Array = np.linspace(self.corner, -self.corner, len(self.heights), dtype=np.float64)
        return np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1)

    @property
    def areas(self) -> Array:
        """Area of the cell about each height that lies inside the wall, shape (n, n), m²."""
        shift = ((np.arange(_PARTS) + 0.5) / _PARTS - 0.5) * self.spacing
        x, y = self.places[..., 0], self.places[..., 1]
        inside = np.zeros(x.shape)
        for dx in shift:
            for dy in shift:
                inside += (x + dx) ** 2 + (y + dy) ** 2 < self.radius**2
        return inside * (self.spacing / _PARTS) ** 2

    def distance(self, points: ArrayLike) -> tuple[Array, Array]:
        """Signed distances of points, shape (..., 3), m, negative below, and their gradients, shape (..., 3)."""
        points = np.asarray(points, float)
        flat = np.array(points.reshape(-1, 3), order="C")
        found, slope = np.empty(len(flat)), np.empty(flat.shape)
        surface.measure_bed(self.heights, self.ground, flat, found, slope)
        return found.reshape(points.shape[:-1]), slope.reshape(points.shape)

    def height_at(self, x: float, y: float) -> float:
        """Height of the surface at a place, m."""
        return surface.find_height(self.heights, self.ground, x, y)


def make_bed(tank: Tank) -> Bed | None:
    """The surface of a tank's waste as heights; none where it is level and has no grid.

    A mound rises as the square of a cosine from its foot to its top; mounds that meet add up.
    """
    waste = tank.waste
    mounds = waste.all_mounds(tank.shell.inner_diameter / 2)
    if not mounds and waste.grid is None:
        return None
    spacing = waste.grid or SPACING
    profile = make_profile(tank.shell)
    half = int(np.ceil(profile.inner_radius / spacing)) + 1
    bed = Bed(np.empty((2 * half + 1, 2 * half + 1)), -half * spacing, spacing, profile.inner_radius)
    heights, places = np.full(bed.heights.shape, waste.level), bed.places
    for mound in mounds:
        middle = mound.radius * np.array([np.cos(mound.azimuth), np.sin(mound.azimuth)])
        part = np.linalg.norm(places - middle, axis=-1) / mound.foot
        heights += np.where(part < 1, mound.height * np.cos(np.minimum(part, 1) * np.pi / 2) ** 2, 0.0)
    return Bed(heights, bed.corner, spacing, profile.inner_radius)


@dataclass(frozen=True, eq=False)
class Diggings:
    """A window of a bed, P heights of it in its rows and columns, in which a tool may cut; arrays have shape (P,).

    Attributes:
        bed: As it was before.
        rows, columns: Of the bed, from first to before last.
        start: Heights before, m.
        floor: Heights of the tank's floor there, m.
        areas: Area that each height stands for, m².
        places: X and y, shape (P, 2), m.
        tool: What cuts.
        rate: Volume that it removes a second at full power, m³/s.
    """

    bed: Bed
    rows: tuple[int, int]
    columns: tuple[int, int]
    start: Array
    floor: Array
    areas: Array
    places: Array
    tool: CuttingTool
    rate: float

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        return self.rows[1] - self.rows[0], self.columns[1] - self.columns[0]

    def cover(self, point: ArrayLike) -> Array:
        """Which part of the cell about each height is under the tool at a point, 0 to 1, to a cell's width at its rim."""
        away = np.linalg.norm(self.places - np.asarray(point)[:2], axis=-1)
        return np.clip((self.tool.width / 2 - away) / self.bed.spacing + 0.5, 0.0, 1.0)

    def dig(self, heights: Array, point: ArrayLike, volume: float) -> float:
        """Lower heights in place under the tool at a point, (3,), m, for a volume, m³; returns the volume that was removed.

        A layer of one thickness goes where the tool covers a cell, part of it at the rim; where it meets the floor or the end
        of the tool's reach, the others give more. Less is removed where less is there.
        """
        cover = by_rows(self.cover(point))
        lowest = float(np.asarray(point)[2]) - self.tool.reach
        return float(lower_layer(heights, self.floor, self.areas, cover, lowest, volume))

    def removed(self, heights: Array) -> Array:
        """Volume between the bed before and heights, shape (..., P), m; shape (...), m³."""
        return (self.start - heights) @ self.areas

    def cut_bed(self, heights: ArrayLike) -> Bed:
        """The whole bed with some heights of the window, shape (P,), m."""
        whole = self.bed.heights.copy()
        whole[slice(*self.rows), slice(*self.columns)] = np.reshape(heights, self.shape)
        return Bed(whole, self.bed.corner, self.bed.spacing, self.bed.radius)


@compiled
def lower_layer(heights: Array, floor: Array, areas: Array, cover: Array, lowest: float, volume: float) -> float:
    """Lower heights as `Diggings.dig` does where a tool that reaches down to a lowest height, m, covers them."""
    room = np.maximum(heights - np.maximum(floor, lowest), 0.0)
    some = np.flatnonzero((cover > 0) & (room > 0))
    if not len(some) or volume <= 0:
        return 0.0
    cover, room, area = cover[some], room[some], areas[some]
    layer = room
    if (area * room).sum() > volume:
        order = np.argsort(room / cover, kind="mergesort")  # those that give all they have come first
        held = (area * room)[order]
        wide = np.cumsum((area * cover)[order][::-1])[::-1]
        thick = (volume - (np.cumsum(held) - held)) / wide
        first = np.argmax(thick <= (room / cover)[order])
        layer = np.minimum(thick[first] * cover, room)
    heights[some] -= layer
    return (area * layer).sum()


def make_diggings(bed: Bed, profile: Profile, tool: CuttingTool, rate: float, patches: Iterable[Patch]) -> Diggings:
    """The window of a bed about some patches, as wide as a tool may cut from within them."""
    corners = np.array([corner for patch in patches for corner in patch.corners])
    margin = tool.width / 2 + 2 * bed.spacing
    ends = (np.array([corners.min(axis=0) - margin, corners.max(axis=0) + margin]) - bed.corner) / bed.spacing
    low = np.clip(np.floor(ends[0]).astype(int), 0, len(bed.heights) - 1)
    high = np.clip(np.ceil(ends[1]).astype(int) + 1, low + 1, len(bed.heights))
    window = slice(int(low[0]), int(high[0])), slice(int(low[1]), int(high[1]))
    places = bed.places[window].reshape(-1, 2)
    return Diggings(
        bed=bed,
        rows=(int(low[0]), int(high[0])),
        columns=(int(low[1]), int(high[1])),
        start=bed.heights[window].ravel(),
        floor=profile.floor_at(np.linalg.norm(places, axis=-1)),
        areas=bed.areas[window].ravel(),
        places=places,
        tool=tool,
        rate=rate,
    )
