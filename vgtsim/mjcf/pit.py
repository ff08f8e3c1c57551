"""Waste that is cut, for the eye: a field of heights that fall, in a hole of the mesh that shows the rest of the waste."""

from __future__ import annotations

import numpy as np

from vgtsim.description import Tank
from vgtsim.geometry import Diggings, make_profile
from vgtsim.graphics import mujoco
from vgtsim.mjcf import names
from vgtsim.mjcf.tank import INSIDE_GROUP, POOL

_SKIRT = 0.01  # m below the floor, to which the field is drawn


def show_pit(spec: mujoco.MjSpec, tank: Tank, diggings: Diggings) -> None:
    """Open the waste that is only seen over the diggings, and put a field of heights there.

    The compiled model has its heights from `lower_waste`.
    """
    from vgtsim.geometry import solids

    mesh = spec.mesh(POOL)
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
