"""The tank in MJCF: one body, drawn by meshes, felt by boxes.

The boxes hang on bodies under it, one for each eighth of each part of the shell: MuJoCo first compares bodies, and a
hollow body that surrounds the arm could never be told apart from it. So finding contacts costs an eighth as much.

MuJoCo shows geom groups 0 to 2 unless told otherwise: a section through the axis, seen from the side of -y.
"""

from __future__ import annotations

from math import atan2, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import Tank
from vgtsim.geometry import (
    DEPTH,
    Bed,
    Diggings,
    Panel,
    Profile,
    Wedge,
    enclose_tank,
    find_hulls,
    make_bed,
    make_profile,
    obstacles,
    ring_radii,
)
from vgtsim.graphics import mujoco
from vgtsim.mjcf import names

if TYPE_CHECKING:
    import trimesh

INSIDE_GROUP = 1  # what every picture shows: back half of liner and wall, arm riser, waste, equipment
BACK_COVER_GROUP = 2  # back half of dome, soil and small risers
CONTACT_GROUP = 3  # the invisible boxes for contact
FRONT_GROUP = 4  # front half of the wall
FRONT_COVER_GROUP = 5  # front half of dome, soil and risers

_POOL = "waste/pool"  # mesh of the waste that is seen
_SKIRT = 0.01  # m below the floor, to which a field of heights that fall is drawn
_PARTS = 8  # bodies around the axis for each part of the shell
_FLOOR, _WALL = ("dish",), ("knuckle", "wall")
_COVERS = ("liner", "wall", "dome", "soil")  # which an open stand has not

_COLOURS = {
    "liner": (0.62, 0.65, 0.68, 1.0),
    "concrete": (0.72, 0.70, 0.66, 1.0),
    "soil": (0.45, 0.33, 0.22, 1.0),
    "riser": (0.45, 0.50, 0.56, 1.0),
    "waste": (0.24, 0.26, 0.13, 1.0),
    "equipment": (0.90, 0.72, 0.15, 1.0),
    "rings": (0.80, 0.82, 0.70, 1.0),
    "contact": (0.90, 0.20, 0.20, 0.3),
}
_SHINE = {"liner": 0.4, "riser": 0.4, "equipment": 0.3}


def add_tank(spec: mujoco.MjSpec, tank: Tank, bed: Bed | None = None) -> None:
    """Add a tank with its risers, waste and equipment to the world, whose frame is G; a bed is waste that is cut in part.

    Differs: the dissertation draws its tank; here the arm can touch it. For contact the tank is enclosed in boxes that lie
    outside it and stand back by at most a centimetre, see `geometry.panels`.
    """
    from vgtsim.geometry import solids  # with trimesh, which an arm alone does without

    profile = make_profile(tank.shell)
    body = spec.worldbody.add_body(name=names.TANK, info="tank")
    for key, rgba in _COLOURS.items():
        spec.add_material(name=f"{names.TANK}/{key}", rgba=rgba, specular=_SHINE.get(key, 0.0), shininess=0.3)
    _add_shell(spec, body, tank, profile)
    for riser in tank.risers:
        group = FRONT_COVER_GROUP if sin(riser.azimuth) < 0 else BACK_COVER_GROUP
        _add_mesh(spec, body, riser.name, solids.make_riser(tank, profile, riser), "riser", group)
    if tank.waste.level:
        _add_mesh(spec, body, _POOL, solids.make_waste(tank, profile), "waste", INSIDE_GROUP)
        _add_waste(spec, body, tank, profile, make_bed(tank) if bed is None else bed)
    rings = solids.make_rings(tank, profile, ring_radii(tank))
    _add_mesh(spec, body, "rings", rings, "rings", INSIDE_GROUP)
    around = obstacles(tank)
    entries = [index for index, item in enumerate(tank.equipment) for _ in item.ring]
    for index, name, axis, radius in zip(entries, around.names, around.axes, around.radii, strict=False):
        shape, info = mujoco.mjtGeom.mjGEOM_CYLINDER, f"tank.equipment.{index}"
        geom = _add_felt(
            body, names.equipment(name), shape, "equipment", info, fromto=axis.ravel(), size=[radius, 0, 0]
        )
        geom.group = INSIDE_GROUP
    _add_solids(spec, body, tank, profile)
    panels, wedges = enclose_tank(tank, profile)
    _add_panels(body, panels)
    _add_wedges(spec, body, wedges)


def _add_solids(spec: mujoco.MjSpec, body: mujoco.MjsBody, tank: Tank, profile: Profile) -> None:
    """Boxes and the convex parts of meshes, which are seen and felt."""
    entries = [(f"tank.boxes.{k}", item) for k, item in enumerate(tank.boxes)]
    entries += [(f"tank.meshes.{k}", item) for k, item in enumerate(tank.meshes)]
    for info, item in ((info, single) for info, entry in entries for single in entry.ring):
        for k, hull in enumerate(hulls := find_hulls(item, profile)):
            name = names.equipment(item.name) + (f"/{k}" if len(hulls) > 1 else "")
            _add_hull(spec, body, name, hull, "equipment", info).group = INSIDE_GROUP


def _add_wedges(spec: mujoco.MjSpec, tank_body: mujoco.MjsBody, wedges: tuple[Wedge, ...]) -> None:
    bodies: dict[str, mujoco.MjsBody] = {}
    for k, wedge in enumerate(wedges):
        name = f"{names.TANK}/wedge/part_{k * _PARTS // len(wedges) + 1}"
        if name not in bodies:
            bodies[name] = tank_body.add_body(name=name)
        _add_hull(spec, bodies[name], f"{names.TANK}/{wedge.name}", wedge.corners, "contact", "tank.arm_riser")


def _add_hull(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, corners: Array, material: str, info: str
) -> mujoco.MjsGeom:
    """Add a convex solid that the arm can touch."""
    mesh = spec.add_mesh(name=name, uservert=corners.ravel(), info=info)
    mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
    return _add_felt(body, name, mujoco.mjtGeom.mjGEOM_MESH, material, info, meshname=name)


def _add_waste(spec: mujoco.MjSpec, body: mujoco.MjsBody, tank: Tank, profile: Profile, bed: Bed | None) -> None:
    """Waste as it is felt: a disc where it is level, or a field of the heights of its bed."""
    if bed is None:
        size = [float(profile.radius_at(tank.waste.level)), DEPTH / 2, 0]
        waste = _add_felt(body, names.WASTE, mujoco.mjtGeom.mjGEOM_CYLINDER, "contact", "tank.waste", size=size)
        waste.pos = [0, 0, tank.waste.level - DEPTH / 2]
        return
    # waste that can be cut may fall to the floor
    low = 0.0 if tank.waste.grid is not None else float(bed.heights.min())
    high, count = float(bed.heights.max()), len(bed.heights)
    part = (bed.heights.T - low) / (high - low)  # rows are along y
    if tank.waste.grid is not None:
        part[0, 0] = 0.0  # of a corner far outside the wall: MuJoCo counts heights from the least one
    size = [-bed.corner, -bed.corner, high - low, DEPTH]
    spec.add_hfield(
        name=names.WASTE, nrow=count, ncol=count, size=size, userdata=part.ravel().tolist(), info="tank.waste"
    )
    place = {"hfieldname": names.WASTE, "pos": [0, 0, low]}
    _add_felt(body, names.WASTE, mujoco.mjtGeom.mjGEOM_HFIELD, "contact", "tank.waste", **place)


def lower_waste(model: mujoco.MjModel, diggings: Diggings, heights: Array) -> None:
    """Give a compiled model new heights of the waste that is cut, shape (P,), m; of a model without tank nothing changes."""
    shown = {names.WASTE: (slice(*diggings.columns), slice(*diggings.rows)), names.PIT: (slice(None), slice(None))}
    for index in range(model.nhfield):
        field = model.hfield(index)
        shape = int(field.nrow[0]), int(field.ncol[0])
        whole = model.hfield_data[field.adr[0] :][: shape[0] * shape[1]].reshape(shape)
        whole[shown[field.name]] = np.reshape(heights, diggings.shape).T / field.size[2]


def show_things(model: mujoco.MjModel, tank: Tank, time: float) -> None:
    """Let a compiled model show and feel, of what appears in its tank, what has come in until a time of the run, s."""
    for name, when in tank.appearances.items():
        there, whole = when <= time, names.equipment(name)
        for index in range(model.ngeom):
            geom = model.geom(index)
            if geom.name == whole or geom.name.startswith(f"{whole}/"):
                geom.contype[0] = there
                geom.group[0] = INSIDE_GROUP if there else CONTACT_GROUP


def _add_shell(spec: mujoco.MjSpec, body: mujoco.MjsBody, tank: Tank, profile: Profile) -> None:
    from vgtsim.geometry import solids

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
            if tank.shell.open and name in _COVERS:
                continue
            _add_mesh(spec, body, f"{name}/{side}", mesh, material, group)


def _add_panels(tank_body: mujoco.MjsBody, panels: tuple[Panel, ...]) -> None:
    bodies: dict[str, mujoco.MjsBody] = {}
    quat = np.empty(4)
    for panel in panels:
        turn = atan2(panel.centre[1], panel.centre[0]) / (2 * pi) % 1.0
        name = f"{names.TANK}/{panel.name.split('/')[0]}/part_{int(turn * _PARTS) + 1}"
        if name not in bodies:
            bodies[name] = tank_body.add_body(name=name)
        mujoco.mju_mat2Quat(quat, panel.axes.ravel())
        box = {"size": panel.half, "pos": panel.centre, "quat": quat}
        _add_felt(bodies[name], f"{names.TANK}/{panel.name}", mujoco.mjtGeom.mjGEOM_BOX, "contact", "tank.shell", **box)


def _add_felt(
    body: mujoco.MjsBody, name: str, shape: mujoco.mjtGeom, material: str, info: str, **place: Any
) -> mujoco.MjsGeom:
    """Add a geom that the arm can touch."""
    geom = body.add_geom(name=name, type=shape, group=CONTACT_GROUP, contype=1, conaffinity=0, info=info, **place)
    geom.material = f"{names.TANK}/{material}"
    return geom


def _add_mesh(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, part: str, mesh: trimesh.Trimesh, material: str, group: int
) -> None:
    """Add a mesh that is only seen."""
    name, shell = f"{names.TANK}/{part}", mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    # as lists: MuJoCo takes the numbers of arrays one by one
    corners, faces = mesh.vertices.ravel().tolist(), mesh.faces.ravel().tolist()
    spec.add_mesh(name=name, uservert=corners, userface=faces, inertia=shell, info="tank")
    geom = body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, contype=0, conaffinity=0)
    geom.group, geom.material = group, f"{names.TANK}/{material}"


def show_pit(spec: mujoco.MjSpec, tank: Tank, diggings: Diggings) -> None:
    """Open the waste that is only seen over the diggings for a field of heights, which `lower_waste` gives the compiled model."""
    from vgtsim.geometry import solids

    mesh = spec.mesh(f"{names.TANK}/{_POOL}")
    whole = solids.open_waste(solids.make_waste(tank, make_profile(tank.shell)), diggings)
    mesh.uservert, mesh.userface = whole.vertices.ravel(), whole.faces.ravel()
    low, high = diggings.places.min(axis=0), diggings.places.max(axis=0)
    rows, columns = diggings.shape
    size = [*(high - low) / 2, float(diggings.start.max()), _SKIRT]
    flat = np.zeros(rows * columns).tolist()
    spec.add_hfield(name=names.PIT, nrow=columns, ncol=rows, size=size, userdata=flat, info="tank.waste")
    geom = spec.body(names.TANK).add_geom(
        name=names.PIT, type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname=names.PIT, pos=[*(high + low) / 2, 0.0]
    )
    geom.contype = geom.conaffinity = 0
    geom.group, geom.material = INSIDE_GROUP, f"{names.TANK}/waste"
