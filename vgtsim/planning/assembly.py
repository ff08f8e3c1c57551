"""An arm assembled on site: where the headroom is less than the arm, it grows module by module while it goes in.

A unit is an active module with the static sections below it. The part of the arm that is in the riser stands in a clamp on the
riser's flange; the next unit is set on it; then mast and hoist lower all by the unit's length, and the clamp takes the new
upper face. All that is above the rim is stowed, so what hangs below a unit is at every height of the whole arm's way in as it
is with the units above it: the way is planned once, for the whole arm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.description import Manipulator
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.kinematics.planar_arm import PlanarArm
from vgtsim.planning.insertion import Insertion
from vgtsim.site import Site

Array = NDArray[np.float64]

CLAMP = 0.3  # m of the standing face above the riser's flange: room for a clamp's jaws and its bolts
HOOK = 0.5  # m of hook and sling above a unit that is set on


@dataclass(frozen=True, eq=False)
class AssemblyStage:
    """A part of the arm and its part of the way in.

    Attributes:
        units: Units of the whole arm, from its tool, that are there.
        chain: Of that part; its mount is at the upper face of its uppermost unit at the end of the stage.
        columns: Of the whole arm's inputs, those of the part.
        begin: Height of that face at the beginning, m; `end` at the end. The whole arm's feed is the height less `drop`.
        drop: Height of the face when the whole arm is at its working depth and stowed, m.
    """

    units: int
    chain: Chain
    columns: NDArray[np.intp]
    begin: float
    end: float
    drop: float

    def inputs(self, way: Insertion, height: Array) -> Array:
        """Inputs of the part with its upper face at heights, shape (W,), m: shape (W, n)."""
        first, last = (float(way.feed(place)) for place in (0.0, 1.0))
        place = np.clip((np.asarray(height) - self.drop - first) / (last - first), 0.0, 1.0)
        return way.spline(place)[..., self.columns]


def cut_arm(arm: Manipulator, first: int) -> Manipulator:
    """The part of an arm from a module on to its tool, which hangs by the base of that module."""
    modules = arm.modules[first:]
    return arm.model_copy(update={"name": f"{arm.name}_from_{modules[0].name}", "modules": modules})


def unit_lengths(planar: PlanarArm) -> Array:
    """Length of each unit of the stowed arm, from the mast to the tool, shape (A,), m; without the tool's offset."""
    lengths = planar.stowed + planar.static[1:]
    lengths[0] += planar.static[0]
    return lengths


def needed_headroom(site: Site) -> float:
    """Free height over the soil that the longest unit needs to be set on, m."""
    planar = PlanarArm(site.chain, 0.0)
    tool = planar.tool_offset * (np.arange(len(planar.stowed)) == len(planar.stowed) - 1)
    return site.tank.arm_riser.above_grade + CLAMP + float(np.max(unit_lengths(planar) + tool)) + HOOK


def check_headroom(site: Site) -> None:
    """Refuse a tank whose headroom is below one unit of the arm.

    Raises:
        DescriptionError: By how much it is short.
    """
    free, needed = site.tank.headroom, needed_headroom(site)
    if free is not None and free < needed:
        found = (
            f"{free:.4g} m, {needed - free:.3g} m less than the longest module of {site.arm.name} needs above the riser"
        )
        raise site.scene.error("tank.headroom", found, f"at least {needed:.4g} m")


def plan_assembly(site: Site, way: Insertion) -> tuple[AssemblyStage, ...]:
    """Cut the way in of a whole arm into stages, one for each unit, from the tool's to the mast's.

    Each stage begins with its unit set on the standing part, its upper face a unit above the clamp, and ends with that face in
    the clamp; the last ends with the way.

    Raises:
        DescriptionError: The headroom is below one unit.
    """
    check_headroom(site)
    planar, layout = PlanarArm(site.chain, way.azimuth), site.chain.layout
    clamp = site.tank.grade + site.tank.arm_riser.above_grade + CLAMP
    lengths, pivot, count = unit_lengths(planar), site.scene.pivot_height, len(layout.names)
    stages = []
    for a in range(count - 1, -1, -1):
        first = 0 if a == 0 else int(layout.modules[a])
        end = clamp if a else pivot + float(way.feed(1.0))
        stage = AssemblyStage(
            units=count - a,
            chain=Chain(cut_arm(site.arm, first), hanging_mount(end, site.tank.arm_riser.place)),
            columns=np.flatnonzero(layout.owner >= a),
            begin=clamp + float(lengths[a]) + (planar.tool_offset if a == count - 1 else 0.0),
            end=end,
            drop=pivot - (float(planar.tops[a]) if a else 0.0),
        )
        stages.append(stage)
    return tuple(stages)
