"""Waste that is cut, for the eye: the hole of the mesh is as wide as the field of heights in it."""

from __future__ import annotations

import numpy as np
import pytest
from digging import over_waste

from vgtsim.geometry import make_profile
from vgtsim.geometry.solids import make_waste, open_waste
from vgtsim.mjcf import build_spec, finish_model, lower_waste, names
from vgtsim.mjcf.tank import show_pit
from vgtsim.site import Site

SINGLE = 1e-6  # m: heights are in single precision


@pytest.fixture(scope="module")
def site(reach_scene):
    return Site(over_waste(reach_scene))


def measure_top(mesh):
    """Area seen from above, m²."""
    up = mesh.face_normals[:, 2] > 0.1
    return float((mesh.area_faces * mesh.face_normals[:, 2])[up].sum())


def test_hole_and_field_make_up_the_surface(site):
    mesh = make_waste(site.tank, make_profile(site.tank.shell))
    low, high = site.diggings.places.min(axis=0), site.diggings.places.max(axis=0)
    hole = measure_top(mesh) - measure_top(open_waste(mesh, site.diggings))
    assert hole == pytest.approx(float(np.prod(high - low)), rel=1e-6)


def test_field_is_drawn_where_the_waste_is(site):
    ground, spec = site.diggings, build_spec(site)
    show_pit(spec, site.tank, ground)
    model = finish_model(spec, site)
    heights = ground.start - np.linspace(0, 0.1, len(ground.start))
    lower_waste(model, ground, heights)
    for name in (names.WASTE, names.PIT):
        field, geom = model.hfield(name), model.geom(name)
        shape = int(field.nrow[0]), int(field.ncol[0])
        data = model.hfield_data[field.adr[0] :][: shape[0] * shape[1]].reshape(shape)
        x, y = (np.linspace(-half, half, count) for half, count in zip(field.size[:2], shape[::-1], strict=True))
        for k in range(0, len(heights), 17):
            i, j = (np.abs(line + geom.pos[a] - ground.places[k, a]).argmin() for a, line in enumerate((x, y)))
            assert geom.pos[2] + data[j, i] * field.size[2] == pytest.approx(heights[k], abs=SINGLE)
