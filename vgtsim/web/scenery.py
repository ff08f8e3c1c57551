"""What stands still on a page: the tank cut open, its waste, equipment and riser with their names, goals, and the light."""

from __future__ import annotations

from math import sin
from typing import TYPE_CHECKING

import numpy as np
import trimesh
from numpy.typing import NDArray

from vgtsim.geometry import make_profile, obstacles, solids, tool_frame
from vgtsim.output.things import name_things
from vgtsim.site import Site

if TYPE_CHECKING:
    from viser import MeshHandle, SceneApi

Array = NDArray[np.float64]

_COLOURS = {
    "liner": (128, 136, 144),
    "concrete": (186, 181, 171),
    "soil": (128, 100, 72),
    "riser": (120, 132, 148),
    "waste": (104, 110, 66),
    "equipment": (222, 178, 52),
}
_GOAL = (38, 190, 96)
SHARP = np.radians(30)  # between faces: from there on an edge is drawn as one
NAME = 0.8  # size of names, of the usual size of text
_BALL, _STEM = 0.10, (0.025, 0.6)  # m: a goal's ball, and radius and length of the rod along its direction
_FLOOR, _WALL = ("dish",), ("knuckle", "wall")


def add_scenery(scene: SceneApi, site: Site) -> None:
    """Add lights, the back half of the tank with all that is in it, and the goals of a site."""
    _light(scene, site)
    tank, profile = site.tank, make_profile(site.tank.shell)
    meshes = [
        ("floor", "liner", solids.make_liner(tank, profile, False, _FLOOR)),
        ("floor/front", "liner", solids.make_liner(tank, profile, True, _FLOOR)),
        ("wall", "liner", solids.make_liner(tank, profile, False, _WALL)),
        ("base", "concrete", solids.make_concrete(tank, profile, False, _FLOOR)),
        ("base/front", "concrete", solids.make_concrete(tank, profile, True, _FLOOR)),
        ("shell", "concrete", solids.make_concrete(tank, profile, False, _WALL)),
        ("dome", "concrete", solids.make_dome(tank, profile, False)),
        ("soil", "soil", solids.make_soil(tank, profile, False)),
        (tank.arm_riser.name, "riser", solids.make_arm_riser(tank, profile, False)),
        *(
            (riser.name, "riser", solids.make_riser(tank, profile, riser))
            for riser in tank.risers
            if sin(riser.azimuth) >= 0
        ),
    ]
    if tank.waste.level:
        meshes.append(("waste", "waste", solids.make_waste(tank, profile)))
    for name, kind, mesh in meshes:
        add_solid(scene, f"/tank/{name}", mesh, _COLOURS[kind])
    around = obstacles(tank)
    for name, axis, radius in zip(around.names, around.axes, around.radii, strict=True):
        pipe = trimesh.creation.cylinder(float(radius), segment=axis, sections=24)
        add_solid(scene, f"/tank/{name}", pipe, _COLOURS["equipment"])
    _name(scene, site)
    _mark_goals(scene, site)


def add_solid(scene: SceneApi, name: str, mesh: trimesh.Trimesh, colour: tuple[int, int, int]) -> MeshHandle:
    """Add a mesh that is round where its faces meet at less than thirty degrees."""
    shaded = trimesh.graph.smooth_shade(mesh, angle=SHARP)
    return scene.add_mesh_simple(name, shaded.vertices, shaded.faces, color=colour, side="double", cast_shadow=False)


def _light(scene: SceneApi, site: Site) -> None:
    """Lamps instead of an environment map, which costs four fifths of the time of drawing without a graphics card."""
    radius, crown = site.tank.shell.inner_diameter / 2, site.tank.shell.crown
    scene.set_up_direction("+z")
    scene.configure_environment_map(None)
    scene.configure_default_lights(enabled=False)
    scene.add_light_hemisphere("/light/sky", sky_color=(255, 255, 255), ground_color=(150, 145, 140), intensity=2.0)
    scene.add_light_directional("/light/lamp", intensity=1.8, position=(-radius, -2 * radius, 3 * crown))
    scene.add_light_directional("/light/fill", intensity=0.8, position=(2 * radius, -2 * radius, crown))


def _name(scene: SceneApi, site: Site) -> None:
    """Write the names of waste, equipment, riser and mast beside them."""
    tank = site.tank
    top = tank.grade + tank.arm_riser.above_grade
    places = name_things(site)
    places |= {tank.arm_riser.name.replace("_", " "): np.array([tank.arm_riser.bore / 2, 0.0, top])}
    for name, place in places.items():
        scene.add_label(
            f"/names/{name.replace(' ', '_')}", name, position=place, font_screen_scale=NAME, anchor="bottom-left"
        )


def _mark_goals(scene: SceneApi, site: Site) -> None:
    """Add the goals, each with its name."""
    for goal in site.task.motion.goals:
        place, mark = np.array(goal.position), make_mark()
        mark.apply_transform(
            trimesh.transformations.compose_matrix(translate=place) @ _turn(tool_frame(goal.direction))
        )
        add_solid(scene, f"/goals/{goal.name}", mark, _GOAL)
        scene.add_label(
            f"/names/{goal.name}", goal.name, position=place, font_screen_scale=NAME, anchor="bottom-center"
        )


def make_mark() -> trimesh.Trimesh:
    """The mark of a goal of the tool: a ball at the origin and a rod along z, the tool's direction."""
    rod = trimesh.creation.cylinder(_STEM[0], height=_STEM[1], sections=8)
    rod.apply_translation([0, 0, _STEM[1] / 2])
    return trimesh.creation.icosphere(2, radius=_BALL) + rod


def _turn(R: Array) -> Array:
    matrix = np.eye(4)
    matrix[:3, :3] = R
    return matrix
