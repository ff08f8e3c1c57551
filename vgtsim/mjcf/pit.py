"""Waste that is cut, for the eye: a field of heights that fall, in a hole of the mesh that shows the rest of the waste."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vgtsim.description import Tank
from vgtsim.geometry import Diggings, make_profile
from vgtsim.graphics import mujoco
from vgtsim.mjcf import names
from vgtsim.mjcf.tank import INSIDE_GROUP, POOL

if TYPE_CHECKING:
    import trimesh

Array = NDArray[np.float64]

_LEVEL = 0.1  # least upward part of the normal of a face that is of the surface; its mounds are no steeper
_SKIRT = 0.01  # m below the floor, to which the field is drawn


def show_pit(spec: mujoco.MjSpec, tank: Tank, diggings: Diggings) -> None:
    """Open the waste that is only seen over the diggings, and put a field of heights there.

    The compiled model has its heights from `lower_waste`.
    """
    from vgtsim.geometry import solids

    mesh = spec.mesh(POOL)
    whole = open_waste(solids.make_waste(tank, make_profile(tank.shell)), diggings)
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


def open_waste(mesh: trimesh.Trimesh, diggings: Diggings) -> trimesh.Trimesh:
    """The waste with a hole in its surface as wide as the diggings."""
    import trimesh
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
