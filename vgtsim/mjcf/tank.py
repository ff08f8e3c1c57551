"""The tank in MJCF: one body, drawn by meshes, felt by boxes.

The boxes hang on bodies of their own under it, one for each eighth of each part of the shell: MuJoCo first
compares bodies, and a hollow body that surrounds the arm could never be told apart from it. So divided,
finding contacts costs an eighth as much.

Geom groups: 1 holds what is always wanted in a picture (back half of liner and wall, arm riser, waste,
equipment), 2 the back half of dome, soil and small risers, 4 the front half of the wall, 5 the front
half of dome, soil and risers, 3 the invisible boxes for contact. MuJoCo shows groups 0 to 2 unless told
otherwise: a section through the axis, seen from the side of -y.
"""

from __future__ import annotations

from math import atan2, pi, sin

import mujoco
import numpy as np
import trimesh

from vgtsim.description.tank import Tank
from vgtsim.geometry import solids
from vgtsim.geometry.clearance import obstacles
from vgtsim.geometry.panels import DEPTH, Panel, make_panels
from vgtsim.geometry.profile import Profile, make_profile
from vgtsim.mjcf import names

INSIDE_GROUP = 1
BACK_COVER_GROUP = 2
CONTACT_GROUP = 3
FRONT_GROUP = 4
FRONT_COVER_GROUP = 5

_PARTS = 8
_FLOOR, _WALL = ("dish",), ("knuckle", "wall")

_COLOURS = {
    "liner": (0.62, 0.65, 0.68, 1.0),
    "concrete": (0.72, 0.70, 0.66, 1.0),
    "soil": (0.45, 0.33, 0.22, 1.0),
    "riser": (0.45, 0.50, 0.56, 1.0),
    "waste": (0.24, 0.26, 0.13, 1.0),
    "equipment": (0.90, 0.72, 0.15, 1.0),
    "contact": (0.90, 0.20, 0.20, 0.3),
}
_SHINE = {"liner": 0.4, "riser": 0.4, "equipment": 0.3}


def add_tank(spec: mujoco.MjSpec, tank: Tank) -> None:
    """Add a tank with its risers, waste and equipment to the world, whose frame is G.

    Differs:
        The dissertation draws its tank; here the arm can touch it. For contact the tank is enclosed in boxes
        that lie outside it and stand back by at most a few centimetres, see `geometry.panels`.
    """
    profile = make_profile(tank.shell)
    body = spec.worldbody.add_body(name=names.TANK)
    body.info = "tank"
    for key, rgba in _COLOURS.items():
        spec.add_material(name=f"{names.TANK}/{key}", rgba=rgba, specular=_SHINE.get(key, 0.0), shininess=0.3)
    _add_shell(spec, body, tank, profile)
    _add_risers(spec, body, tank, profile)
    _add_waste(spec, body, tank, profile)
    _add_equipment(body, tank)
    _add_panels(body, make_panels(tank, profile))


def _add_shell(spec: mujoco.MjSpec, body: mujoco.MjsBody, tank: Tank, profile: Profile) -> None:
    for side, front in (("back", False), ("front", True)):
        low = FRONT_GROUP if front else INSIDE_GROUP
        high = FRONT_COVER_GROUP if front else BACK_COVER_GROUP
        riser = FRONT_COVER_GROUP if front else INSIDE_GROUP
        parts = (
            ("floor", "liner", solids.make_liner(tank, profile, front, _FLOOR), INSIDE_GROUP),
            ("liner", "liner", solids.make_liner(tank, profile, front, _WALL), low),
            ("base", "concrete", solids.make_concrete(tank, profile, front, _FLOOR), INSIDE_GROUP),
            ("wall", "concrete", solids.make_concrete(tank, profile, front, _WALL), low),
            ("dome", "concrete", solids.make_dome(tank, profile, front), high),
            ("soil", "soil", solids.make_soil(tank, profile, front), high),
            (tank.arm_riser.name, "riser", solids.make_arm_riser(tank, profile, front), riser),
        )
        for name, material, mesh, group in parts:
            _add_mesh(spec, body, f"{names.TANK}/{name}/{side}", mesh, material, group)


def _add_risers(spec: mujoco.MjSpec, body: mujoco.MjsBody, tank: Tank, profile: Profile) -> None:
    for riser in tank.risers:
        group = FRONT_COVER_GROUP if sin(riser.azimuth) < 0 else BACK_COVER_GROUP
        mesh = solids.make_riser(tank, profile, riser)
        _add_mesh(spec, body, f"{names.TANK}/{riser.name}", mesh, "riser", group)


def _add_waste(spec: mujoco.MjSpec, body: mujoco.MjsBody, tank: Tank, profile: Profile) -> None:
    level = tank.waste.level
    if not level:
        return
    _add_mesh(spec, body, f"{names.WASTE}/pool", solids.make_waste(tank, profile), "waste", INSIDE_GROUP)
    geom = body.add_geom(
        name=names.WASTE, type=mujoco.mjtGeom.mjGEOM_CYLINDER, group=CONTACT_GROUP, contype=1, conaffinity=0
    )
    geom.size = [float(profile.radius_at(level)), DEPTH / 2, 0]
    geom.pos = [0, 0, level - DEPTH / 2]
    geom.material = f"{names.TANK}/contact"
    geom.info = "tank.waste"


def _add_equipment(body: mujoco.MjsBody, tank: Tank) -> None:
    around = obstacles(tank)
    for index, (name, axis, radius) in enumerate(zip(around.names, around.axes, around.radii, strict=True)):
        geom = body.add_geom(name=names.equipment(name), type=mujoco.mjtGeom.mjGEOM_CYLINDER, contype=1, conaffinity=0)
        geom.fromto = axis.ravel()
        geom.size = [radius, 0, 0]
        geom.group = INSIDE_GROUP
        geom.material = f"{names.TANK}/equipment"
        geom.info = f"tank.equipment.{index}"


def _add_panels(tank_body: mujoco.MjsBody, panels: tuple[Panel, ...]) -> None:
    bodies: dict[str, mujoco.MjsBody] = {}
    quat = np.empty(4)
    for panel in panels:
        turn = atan2(panel.centre[1], panel.centre[0]) / (2 * pi) % 1.0
        name = f"{names.TANK}/{panel.name.split('/')[0]}/part_{int(turn * _PARTS) + 1}"
        if name not in bodies:
            bodies[name] = tank_body.add_body(name=name)
        geom = bodies[name].add_geom(name=f"{names.TANK}/{panel.name}", type=mujoco.mjtGeom.mjGEOM_BOX)
        geom.contype, geom.conaffinity = 1, 0
        mujoco.mju_mat2Quat(quat, panel.axes.ravel())
        geom.size, geom.pos, geom.quat = panel.half, panel.centre, quat
        geom.group = CONTACT_GROUP
        geom.material = f"{names.TANK}/contact"
        geom.info = "tank.shell"


def _add_mesh(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, mesh: trimesh.Trimesh, material: str, group: int
) -> None:
    asset = spec.add_mesh(name=name, uservert=mesh.vertices.ravel(), userface=mesh.faces.ravel())
    asset.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    asset.info = "tank"
    geom = body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, contype=0, conaffinity=0)
    geom.group = group
    geom.material = f"{names.TANK}/{material}"
