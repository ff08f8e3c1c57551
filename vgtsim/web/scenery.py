"""What stands still on a page: the tank cut open, its waste, equipment and risers with their names, goals, and the light.

Light and shade of solids are colours of their corners: a page draws them without lamps, at a third of the cost.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from math import sin
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import trimesh
from trimesh.exchange.gltf import export_glb
from trimesh.visual import ColorVisuals

from vgtsim.arrays import Array
from vgtsim.description import Tank
from vgtsim.geometry import Diggings, Profile, find_hulls, make_profile, obstacles, ring_radii, solids, tool_frame
from vgtsim.output.readings import name_things
from vgtsim.site import Site

if TYPE_CHECKING:
    from viser import GlbHandle, MeshHandle, SceneApi, ViserServer

Anchor = Literal["bottom-left", "bottom-center"]
Colour = tuple[int, int, int]  # red, green and blue to 255
Piece = tuple[trimesh.Trimesh, Colour]

_LINER, _CONCRETE, _SOIL, _RISER = (150, 158, 168), (206, 201, 190), (150, 118, 86), (140, 152, 168)
_WASTE, _EQUIPMENT, _GOAL = (134, 132, 74), (232, 186, 52), (40, 190, 96)
_RINGS = (84, 90, 98)
NAME = 0.8  # size of names, of the usual size of text
_BALL, _STEM = 0.10, (0.025, 0.6)  # m: a goal's ball, and radius and length of the rod along its direction
_SIDES, _FEW = 24, 8  # of round things, and of thin ones
_FLOOR, _WALL = ("dish",), ("knuckle", "wall")
# m, of points along the tank's profile: a third of the triangles, each within a centimetre of the surface
_SPACING = 1.0
_FIELD = np.radians(38)  # of view, upright
SHARP = np.radians(30)  # between faces: from there on an edge is drawn as one
_LAMP = np.array([-0.42, -0.70, 0.57])  # unit vector toward it: from the left, in front and above
_DARK, _LAMP_PART, _SKY_PART = 0.62, 0.34, 0.10  # of a colour: in the shade, by the lamp, and by the sky above
_GAMMA = 2.2  # colours in glTF are linear
_UNLIT = "KHR_materials_unlit"


def add_scenery(server: ViserServer, site: Site) -> None:
    """Add light, the back half of the tank with all that is in it, and the goals of a site; look at it from the open side."""
    radius, crown = site.tank.shell.inner_diameter / 2, site.tank.shell.crown
    camera, scene = server.initial_camera, server.scene
    camera.position, camera.look_at = (0.0, -2.35 * radius, 0.9 * crown), (0.0, 0.0, 0.52 * crown)
    camera.fov = _FIELD
    scene.set_up_direction("+z")
    # an environment map costs four fifths of the time of drawing without a graphics card; without any light steel is black
    scene.configure_environment_map(None)
    scene.configure_default_lights(enabled=False)
    scene.add_light_hemisphere("/light/sky", sky_color=(255, 255, 255), ground_color=(150, 145, 140), intensity=2.2)
    scene.add_light_directional("/light/lamp", intensity=1.6, position=(-radius, -2 * radius, 3 * crown))
    show_tank(scene, site.tank, site.diggings)
    _name(scene, site)
    for goal in site.task.motion.goals:
        mark, matrix = make_mark(), np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = tool_frame(goal.direction), goal.position
        add_baked(scene, f"/goals/{goal.name}", [(mark.apply_transform(matrix), _GOAL)])
        add_name(scene, f"/names/{goal.name}", goal.name, np.array(goal.position) + [0, 0, _BALL])


def show_tank(scene: SceneApi, tank: Tank, diggings: Diggings | None = None) -> None:
    """Add the back half of a tank with all that is in it; the waste is open over the diggings, see `add_pit`."""
    profile, around = make_profile(tank.shell), obstacles(tank)
    shell = _make_layers(tank, profile, False, _FLOOR) + _make_layers(tank, profile, True, _FLOOR)
    if not tank.shell.open:
        shell += _make_layers(tank, profile, False, _WALL)
        shell += [(solids.make_dome(tank, profile, False, _SPACING, covered=True), _CONCRETE)]
        soil = solids.make_soil(tank, profile, False, _SPACING, covered=True)
        add_baked(scene, "/tank/soil", [(soil, _SOIL)])
    risers = [solids.make_riser(tank, profile, riser) for riser in tank.risers if sin(riser.azimuth) >= 0]
    add_baked(scene, "/tank/shell", shell)
    pipes = [solids.make_arm_riser(tank, profile, False), *risers]
    add_baked(scene, "/tank/risers", [(pipe, _RISER) for pipe in pipes])
    if tank.waste.level:
        waste = solids.make_waste(tank, profile, _SPACING)
        waste = waste if diggings is None else solids.open_waste(waste, diggings)
        add_baked(scene, "/tank/waste", [(waste, _WASTE)], both=diggings is not None)
    for name, axis, radius in zip(around.names, around.axes, around.radii, strict=False):  # cylinders come first
        pipe = trimesh.creation.cylinder(float(radius), segment=axis, sections=_SIDES)
        add_baked(scene, f"/tank/{name}", [(pipe, _EQUIPMENT)])
    for item in tank.solids:
        hulls = [trimesh.convex.convex_hull(corners) for corners in find_hulls(item, profile)]
        add_baked(scene, f"/tank/{item.name}", [(hull, _EQUIPMENT) for hull in hulls])
    rings = solids.make_rings(tank, profile, ring_radii(tank))
    rings.update_faces(np.arange(len(rings.faces)) < len(rings.faces) // 2)  # surfaces are seen from both sides here
    add_baked(scene, "/tank/rings", [(rings, _RINGS)], both=True)


def _make_layers(tank: Tank, profile: Profile, front: bool, pieces: tuple[str, ...]) -> list[Piece]:
    """Liner and concrete of half a shell, without the surfaces where they meet."""
    liner = solids.make_liner(tank, profile, front, pieces, _SPACING, covered=True)
    return [(liner, _LINER), (solids.make_concrete(tank, profile, front, pieces, _SPACING, covered=True), _CONCRETE)]


def add_pit(scene: SceneApi, diggings: Diggings) -> MeshHandle:
    """Add the surface of the waste that may be cut; `place_pit` gives its corners for other heights."""
    rows, columns = diggings.shape
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    faces = np.concatenate(
        [first[:, None] + [0, 1, columns], first[:, None] + [1, columns + 1, columns]]  # seen from both sides
    )
    return scene.add_mesh_simple(
        "/tank/pit",
        place_pit(diggings, diggings.start),
        faces,
        color=_WASTE,
        flat_shading=True,
        side="double",
        cast_shadow=False,
        receive_shadow=False,
    )


def place_pit(diggings: Diggings, heights: Array) -> Array:
    """Corners of the surface of heights, shape (P, 3), m, for heights of shape (P,), m."""
    return np.column_stack([diggings.places, heights])


def _name(scene: SceneApi, site: Site) -> None:
    """Write the names of waste, equipment and the arm's riser beside them."""
    riser = site.tank.arm_riser
    top = np.array([riser.place[0] + riser.bore / 2 + riser.wall, riser.place[1], site.tank.grade + riser.above_grade])
    for name, place in (name_things(site) | {riser.name.replace("_", " "): top}).items():
        add_name(scene, f"/names/{name.replace(' ', '_')}", name, place, "bottom-left")


def add_name(scene: SceneApi, name: str, text: str, place: Array, anchor: Anchor = "bottom-center") -> None:
    """Write a text at a place, shape (3,), m."""
    scene.add_label(name, text, position=place, font_screen_scale=NAME, anchor=anchor)


def make_mark(size: float = 1.0) -> trimesh.Trimesh:
    """The mark of a goal of the tool, some times the usual size: a ball at the origin and a rod along z, the tool's direction."""
    rod = trimesh.creation.cylinder(_STEM[0], height=_STEM[1], sections=_FEW)
    mark = trimesh.creation.icosphere(2, radius=_BALL) + rod.apply_translation([0, 0, _STEM[1] / 2])
    return mark.apply_scale(size)


def add_baked(scene: SceneApi, name: str, solids: Iterable[Piece], *, both: bool = False) -> GlbHandle:
    """Add solids as one thing that casts and takes no shadow, drawn from outside alone, or from both sides: twice the cost."""
    mesh = trimesh.util.concatenate([_shade(solid, colour) for solid, colour in solids])
    data = export_glb(trimesh.Scene(mesh), include_normals=False, tree_postprocessor=partial(_unlight, both=both))
    return scene.add_glb(name, data, cast_shadow=False, receive_shadow=False)


def _shade(solid: trimesh.Trimesh, colour: Colour) -> trimesh.Trimesh:
    """A solid with a colour at each corner, its edges sharp where its faces meet at more than thirty degrees."""
    mesh = trimesh.graph.smooth_shade(solid, angle=SHARP)
    normals = np.asarray(mesh.vertex_normals)
    light = _DARK + _LAMP_PART * np.clip(normals @ _LAMP, 0, 1) + _SKY_PART * normals[:, 2]
    linear: Array = np.clip(np.array(colour) / 255 * light[:, None], 0, 1) ** _GAMMA
    shown = np.concatenate([linear, np.ones((len(linear), 1))], axis=-1)
    mesh.visual = ColorVisuals(mesh, vertex_colors=np.round(255 * shown).astype(np.uint8))
    return mesh


def _unlight(tree: dict[str, Any], *, both: bool) -> None:
    """Give all surfaces of a glTF tree a material that shows the colours of the corners as they are."""
    tree["extensionsUsed"] = [*tree.get("extensionsUsed", []), _UNLIT]
    tree["materials"] = [{"doubleSided": both, "extensions": {_UNLIT: {}}}]
    for mesh in tree["meshes"]:
        for primitive in mesh["primitives"]:
            primitive["material"] = 0
