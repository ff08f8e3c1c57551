"""The surface of the waste: level, or a grid of heights with mounds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description import Tank
from vgtsim.geometry import surface
from vgtsim.geometry.profile import make_profile

Array = NDArray[np.float64]

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
        steep = max(
            (x[:, :-1] ** 2 + y[1:] ** 2).max(), (x[:, 1:] ** 2 + y[:-1] ** 2).max()
        )  # of both triangles of each cell
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
