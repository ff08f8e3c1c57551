"""The tank for the eye: solids of revolution in two halves, so that a picture can leave the near half out.

The back half is on the side of +y, the front half on the side of -y. All meshes are closed and in frame G.
"""

from __future__ import annotations

from functools import lru_cache
from math import ceil, pi
from typing import Literal

import numpy as np
import trimesh
from numpy.typing import NDArray

from vgtsim.arrays import Array
from vgtsim.description import Riser, Tank
from vgtsim.geometry.bed import Diggings, make_bed
from vgtsim.geometry.clearance import interior_distance
from vgtsim.geometry.profile import Profile

# Spacing of points along the profile, m, and sectors of a half turn: a picture shows no more.
_SPACING = 0.35
_SECTORS = 36
_PIPE_SECTORS = 12
_LINE, _OVER = 0.03, 0.02  # m: width of a line on the waste, and how far over it
_HALVINGS = 6  # of the faces about a hole at most, until they are an eighth of its radius
_LEVEL = 0.1  # least upward part of the normal of a face that is of the surface; its mounds are no steeper
_RINGS = 60  # of an uneven bed of waste: the spacing of its heights


def revolve_strip(near: Array, far: Array, front: bool, without: Literal["near", "far", ""] = "") -> trimesh.Trimesh:
    """Turn the strip between two curves (r, z), shape (n, 2), m, through half a turn; a closed mesh with outward normals.

    The inner curve runs anticlockwise, seen with r to the right and z up; outer points are paired with inner ones. The
    front half is on the side of -y. The surface of one curve may be left out.
    """
    vertices, faces = _turn_strip(near.tobytes(), far.tobytes(), without)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if front:
        mesh.apply_transform(trimesh.transformations.rotation_matrix(pi, [0, 0, 1]))
    return mesh


@lru_cache(maxsize=32)  # half of a tank is the other half turned, and scenes of a program share their tank
def _turn_strip(inner: bytes, outer: bytes, without: str) -> tuple[Array, NDArray[np.int64]]:
    """Vertices and faces of the half on the side of +y, from the bytes of both curves."""
    near, far = (np.frombuffer(curve).reshape(-1, 2) for curve in (inner, outer))
    outline = np.concatenate([near, far[::-1], near[:1]])
    mesh = trimesh.creation.revolve(outline, angle=pi, sections=_SECTORS, process=False)
    i = np.arange(len(near) - 1)
    j = 2 * len(near) - 1 - i
    cap = np.concatenate([np.stack([i, i + 1, j - 1], -1), np.stack([i, j - 1, j], -1)])
    faces = np.concatenate([mesh.faces, cap, cap[:, ::-1] + len(mesh.vertices) - len(outline)])
    curve = faces % len(outline) // len(near)  # near and far, and near again at the end of the outline
    surface = np.isin(curve, {"near": (0, 2), "far": (1,), "": ()}[without]).all(axis=1)
    mesh = trimesh.Trimesh(mesh.vertices, faces, process=True)
    kept = mesh.nondegenerate_faces() & ~surface
    if mesh.volume < 0:
        mesh.invert()
    return np.array(mesh.vertices), np.array(mesh.faces[kept])


def make_liner(
    tank: Tank,
    profile: Profile,
    front: bool,
    pieces: tuple[str, ...],
    spacing: float = _SPACING,
    *,
    covered: bool = False,
) -> trimesh.Trimesh:
    """Half of the steel liner along some pieces of the profile, on points at most a spacing, m, apart.

    A covered one is without its surface on the concrete, which nobody sees. So it is with the next ones.
    """
    inner = _curve(profile, pieces, spacing)
    outer = _offset(profile, inner, tank.shell.liner_thickness)
    return revolve_strip(inner, outer, front, without="far" if covered else "")


def make_concrete(
    tank: Tank,
    profile: Profile,
    front: bool,
    pieces: tuple[str, ...],
    spacing: float = _SPACING,
    *,
    covered: bool = False,
) -> trimesh.Trimesh:
    """Half of the concrete behind the liner along some pieces of the profile, drawn as thick as the dome."""
    inner = _curve(profile, pieces, spacing)
    liner, thickness = tank.shell.liner_thickness, tank.shell.dome_thickness
    near, far = _offset(profile, inner, liner), _offset(profile, inner, liner + thickness)
    return revolve_strip(near, far, front, without="near" if covered else "")


def make_dome(
    tank: Tank, profile: Profile, front: bool, spacing: float = _SPACING, *, covered: bool = False
) -> trimesh.Trimesh:
    """Half of the concrete dome, open at the arm riser; the soil covers it."""
    inner = _ceiling(tank, profile, spacing)
    outer = _cover(tank, profile, inner)
    return _open(tank, revolve_strip(inner, outer, front, without="far" if covered else ""))


def make_soil(
    tank: Tank, profile: Profile, front: bool, spacing: float = _SPACING, *, covered: bool = False
) -> trimesh.Trimesh:
    """Half of the soil on the dome up to grade."""
    below = _cover(tank, profile, _ceiling(tank, profile, spacing))
    above = np.stack([below[:, 0], np.full(len(below), tank.grade)], -1)
    return _open(tank, revolve_strip(below, above, front, without="near" if covered else ""))


def _open(tank: Tank, mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """A cover with a hole for an arm riser beside the axis: faces in it are left out, corners in it move to its edge."""
    riser = tank.arm_riser
    if not riser.radius:
        return mesh
    hole, middle = riser.bore / 2 + riser.wall, np.array(riser.place)
    for _ in range(_HALVINGS):
        away = np.linalg.norm(mesh.vertices[:, :2] - middle, axis=1)[mesh.faces]
        reach = np.linalg.norm(np.ptp(mesh.vertices[mesh.faces, :2], axis=1), axis=1)
        mesh = mesh.subdivide(np.flatnonzero((away.min(axis=1) < hole + reach) & (reach > hole / 8)))
    corners = np.array(mesh.vertices)
    out = corners[:, :2] - middle
    away = np.linalg.norm(out, axis=1)
    inside = away < hole
    corners[inside, :2] = middle + out[inside] * (hole / np.maximum(away[inside], 1e-9))[:, None]
    return trimesh.Trimesh(corners, mesh.faces[~inside[mesh.faces].all(axis=1)], process=False)


def make_arm_riser(tank: Tank, profile: Profile, front: bool) -> trimesh.Trimesh:
    """Half of the arm riser's pipe, from the dome's underside to its flange."""
    riser = tank.arm_riser
    span = np.array([profile.rim(riser.bore / 2, riser.radius), tank.grade + riser.above_grade])
    radii = riser.bore / 2, riser.bore / 2 + riser.wall
    inner, outer = (np.stack([np.full(2, radius), span], -1) for radius in radii)
    pipe = revolve_strip(inner, outer, front)
    return pipe.apply_translation([*riser.place, 0.0]) if riser.radius else pipe


def make_riser(tank: Tank, profile: Profile, riser: Riser) -> trimesh.Trimesh:
    """The pipe of one of the other risers, whole and in its place."""
    bottom, top = float(profile.ceiling_at(riser.radius)), tank.grade + riser.above_grade
    inner, outer = riser.bore / 2, riser.bore / 2 + riser.wall
    pipe = trimesh.creation.annulus(inner, outer, height=top - bottom, sections=_PIPE_SECTORS)
    x, y = riser.radius * np.cos(riser.azimuth), riser.radius * np.sin(riser.azimuth)
    pipe.apply_translation([x, y, (top + bottom) / 2])
    return pipe


def make_waste(tank: Tank, profile: Profile, spacing: float = _SPACING) -> trimesh.Trimesh:
    """The waste: the tank below its level, or below its bed."""
    level, bed = tank.waste.level, make_bed(tank)
    below = _curve(profile, ("dish", "knuckle", "wall"), spacing)
    below = below[below[:, 1] < level]
    inward = np.linspace(float(profile.radius_at(level)), 0.0, 2 if bed is None else _RINGS)
    top = np.stack([inward, np.full(len(inward), level)], axis=-1)
    mesh = trimesh.creation.revolve(np.concatenate([below, top]), sections=2 * _SECTORS)
    if bed is not None:
        corners = np.array(mesh.vertices)
        for k in np.flatnonzero(corners[:, 2] == level):
            corners[k, 2] = bed.height_at(*corners[k, :2])
        mesh.vertices = corners
    return mesh


def open_waste(mesh: trimesh.Trimesh, diggings: Diggings) -> trimesh.Trimesh:
    """The waste with a hole in its surface as wide as the diggings."""
    from scipy.spatial import Delaunay

    top = mesh.face_normals[:, 2] > _LEVEL
    vertices = np.array(mesh.vertices)
    surface = vertices[np.unique(mesh.faces[top])]
    low, high = diggings.places.min(axis=0), diggings.places.max(axis=0)
    beside = ((surface[:, :2] < low - diggings.bed.spacing) | (surface[:, :2] > high + diggings.bed.spacing)).any(
        axis=1
    )
    rim = (np.isclose(diggings.places, low) | np.isclose(diggings.places, high)).any(axis=1)
    edge = np.concatenate([diggings.places[rim], diggings.start[rim, None]], axis=1)
    points = np.concatenate([surface[beside], edge])
    faces = Delaunay(points[:, :2]).simplices
    middle = points[faces][..., :2].mean(axis=1)
    kept = faces[((middle < low) | (middle > high)).any(axis=1)]
    turned = np.cross(*(np.diff(points[kept], axis=1).swapaxes(0, 1)))[:, 2] < 0
    kept[turned] = kept[turned][:, ::-1]
    return trimesh.Trimesh(
        np.concatenate([vertices, points]), np.concatenate([mesh.faces[~top], kept + len(vertices)]), process=False
    )


def make_rings(tank: Tank, profile: Profile, radii: list[float]) -> trimesh.Trimesh:
    """Lines on waste or floor at some radii, m, and along every thirtieth degree of azimuth, for the eye."""
    bed, turn = make_bed(tank), np.linspace(0, 2 * pi, 6 * _SECTORS + 1)
    strips = [(radius + side * _LINE / 2, turn) for radius in radii for side in (-1, 1)]
    spokes = np.linspace(radii[0], radii[-1], max(round((radii[-1] - radii[0]) / _SPACING), 1) + 1)
    for angle in np.radians(np.arange(0, 360, 30)):
        strips += [(spokes, angle + side * _LINE / 2 / spokes) for side in (-1, 1)]
    curves = [np.stack([r * np.cos(a), r * np.sin(a)], -1) for r, a in strips]
    corners, faces = np.concatenate(curves), []
    begin = 0
    for near, far in zip(curves[::2], curves[1::2], strict=True):
        i = begin + np.arange(len(near) - 1)
        j = i + len(near)
        faces += [np.stack([i, j, i + 1], -1), np.stack([j, j + 1, i + 1], -1)]
        begin += len(near) + len(far)
    high = profile.floor_at(np.linalg.norm(corners, axis=1))
    level = np.full(len(corners), tank.waste.level) if bed is None else np.array([bed.height_at(*c) for c in corners])
    place = np.column_stack([corners, np.maximum(high, level) + _OVER])
    both = np.concatenate(faces)
    return trimesh.Trimesh(place, np.concatenate([both, both[:, ::-1]]), process=False)


def _curve(profile: Profile, names: tuple[str, ...], spacing: float) -> Array:
    """Points along some of the pieces, ends included, shape (n, 2), m."""
    parts = []
    for piece in (piece for piece in profile.pieces if piece.name in names):
        # twelve degrees at most between neighbours, so that the tight arcs look round
        count = max(ceil(piece.length / spacing) if piece.turn else 1, ceil(piece.turn / (pi / 15)))
        parts.append(piece.at(np.linspace(0, piece.length, count + 1))[1 if parts else 0 :])
    return np.concatenate(parts)


def _ceiling(tank: Tank, profile: Profile, spacing: float) -> Array:
    """The dome's underside from the wall to the arm riser's pipe."""
    points = _curve(profile, ("haunch", "dome"), spacing)
    if tank.arm_riser.radius:  # the hole is cut beside the axis
        return np.concatenate([points[:-1], [[0.0, profile.crown]]])
    opening = tank.arm_riser.bore / 2 + tank.arm_riser.wall
    points = points[points[:, 0] > opening]
    return np.concatenate([points, [[opening, float(profile.ceiling_at(opening))]]])


def _cover(tank: Tank, profile: Profile, inner: Array) -> Array:
    """The dome's outer face, upright at the arm riser's pipe."""
    outer = _offset(profile, inner, tank.shell.dome_thickness)
    outer[-1, 0] = inner[-1, 0]
    return outer


def _offset(profile: Profile, points: Array, depth: float) -> Array:
    """Points moved out of the tank along the normal, shape (n, 2), m."""
    flat = np.stack([points[:, 0], np.zeros(len(points)), points[:, 1]], -1)
    moved = points - depth * interior_distance(profile, flat)[1][:, [0, 2]]
    moved[points[:, 0] == 0, 0] = 0.0
    return moved
