"""The part of a bed of waste that is cut away: heights that fall, and never more than is there."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.compilation import by_rows, compiled
from vgtsim.description import CuttingTool, Patch
from vgtsim.geometry.bed import Bed
from vgtsim.geometry.profile import Profile

Array = NDArray[np.float64]


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
