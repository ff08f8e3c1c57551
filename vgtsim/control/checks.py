"""Whether a scene can work at all: what is checked before anything is planned."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.control.riser import check_riser
from vgtsim.description.scene import Scene
from vgtsim.errors import AssemblyError
from vgtsim.geometry import enclosure_distance, segment_distance
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.double_octahedron import length_jacobian
from vgtsim.kinematics.start import start_inputs
from vgtsim.kinematics.stroke_boxes import check_strokes
from vgtsim.redundancy.strokes import make_box
from vgtsim.redundancy.surroundings import Surroundings

Array = NDArray[np.float64]


def surroundings_of(scene: Scene, chain: Chain) -> Surroundings:
    """What the arm of a scene must keep clear of.

    Args:
        scene: The scene.
        chain: Its arm on its mast.

    Returns:
        Tank, equipment, waste, mast and the arm itself with its payload.
    """
    task = scene.task
    return Surroundings(chain, scene.tank, task.payload.radius, task.mast.outer_diameter / 2)


def check_scene(scene: Scene, chain: Chain) -> None:
    """Refuse a scene that cannot work, before any planning.

    Args:
        scene: The scene.
        chain: Its arm on its mast.

    Raises:
        DescriptionError: A module does not assemble over its strokes; the stowed arm does not pass the riser;
            the start is outside a stroke or too near something; a goal is outside the tank or too near
            something.
    """
    _check_assembly(scene, chain)
    check_riser(scene, chain)
    _check_start(scene, chain)
    _check_goals(scene, chain)


def _check_assembly(scene: Scene, chain: Chain) -> None:
    """Strokes over which a module does not assemble, or might change its assembly, are refused."""
    try:
        check_strokes(chain)
    except AssemblyError as error:
        modules = scene.manipulator.active
        own = scene.manipulator.cylinders[next(item.cylinder for item in modules if item.name == error.module)]
        raise scene.error(
            f"manipulator.modules.{error.module}.cylinder",
            f"a stroke from {own.retracted:.4f} to {own.extended:.4f} m: {error}",
            f"a stroke over whose whole range {error.module} assembles",
        ) from None


def _check_start(scene: Scene, chain: Chain) -> None:
    motion = scene.task.motion
    q = start_inputs(scene, chain)
    box = make_box(chain, motion.stroke_margin)
    for a, module in enumerate(scene.manipulator.active):
        try:
            length = length_jacobian(chain.geometries[a], q[a])[0]
        except (AssemblyError, ValueError) as error:
            raise scene.error(
                f"motion.start.{a}", f"a shape {module.name} cannot take: {error}", "a smaller bend"
            ) from None
        spare = np.minimum(length - box.least[a], box.greatest[a] - length)
        if np.min(spare) <= 0:
            worst = int(np.argmin(spare))
            raise scene.error(
                f"motion.start.{a}",
                f"{module.name}/actuator/{worst + 1} at {length[worst]:.4f} m",
                f"{box.least[a, worst]:.4f} to {box.greatest[a, worst]:.4f} m: its stroke less the margin",
            )
    clearance, place = surroundings_of(scene, chain).least(q)
    if clearance < motion.clearance:
        raise scene.error(
            "motion.start", f"a shape that comes to {clearance:.3f} m of {place}", f"{motion.clearance:.3f} m"
        )


def _check_goals(scene: Scene, chain: Chain) -> None:
    """The ball of the payload at each goal must keep the planned clearance from everything that stands."""
    around = surroundings_of(scene, chain)
    radius, wanted = scene.task.payload.radius, scene.task.motion.clearance
    places = around.obstacles
    for index, goal in enumerate(scene.task.motion.goals):
        point = np.array(goal.position)
        gaps = {"the tank's shell": float(enclosure_distance(scene.tank, around.profile, point)[0])}
        gaps["the waste"] = float(point[2] - places.waste_level)
        for name, axis, thick in zip(places.names, places.axes, places.radii, strict=True):
            gaps[name] = float(segment_distance(point, point, axis[0], axis[1])[0] - thick)
        place = min(gaps, key=lambda name: gaps[name])
        if gaps[place] < radius + wanted:
            side = "inside" if gaps[place] < 0 else f"{gaps[place]:.3f} m from"
            raise scene.error(
                f"motion.goals.{index}.position",
                f"{goal.name} at ({point[0]:.3f}, {point[1]:.3f}, {point[2]:.3f}) m, {side} {place}",
                f"at least {radius + wanted:.3f} m from everything: payload radius and clearance",
            )
