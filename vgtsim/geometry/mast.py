"""The pipe that carries the arm: how long it is and what it weighs."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from vgtsim.constants import MAST_STICK_UP
from vgtsim.description import Scene


@dataclass(frozen=True)
class MastPipe:
    """The mast at its working depth: diameter, wall and length from the pivot's flange to its top, m; density, kg/m³."""

    outer_diameter: float
    wall: float
    density: float
    length: float

    @property
    def mass(self) -> float:
        """Mass of the pipe, kg."""
        return self.density * pi * self.wall * (self.outer_diameter - self.wall) * self.length

    @property
    def axial_inertia(self) -> float:
        """Moment of inertia of the pipe about its axis, kg·m²."""
        outer = self.outer_diameter / 2
        return self.mass * (outer**2 + (outer - self.wall) ** 2) / 2


def make_mast(scene: Scene) -> MastPipe:
    """The mast of a scene, from the pivot to `MAST_STICK_UP` above the riser's flange."""
    mast, tank = scene.task.mast, scene.tank
    return MastPipe(
        outer_diameter=mast.outer_diameter,
        wall=mast.wall,
        density=mast.density,
        length=tank.grade + tank.arm_riser.above_grade - scene.pivot_height + MAST_STICK_UP,
    )
