from pathlib import Path

import numpy as np
import pytest

from vgtsim.description import load_manipulator
from vgtsim.kinematics import Chain
from vgtsim.kinematics.inertia import make_member_inertia, make_plate_inertia, member_radii

QUADRATURE = 1e-12  # Gauss points integrate these polynomials exactly


@pytest.fixture(scope="module")
def chain():
    arm = load_manipulator(Path(__file__).parents[2] / "models" / "arm15" / "arm15.toml")
    return Chain(arm, np.eye(4))


@pytest.fixture(scope="module")
def inertia(chain):
    return make_member_inertia(chain)


def integrate(density, inner, outer, start, end):
    """Mass, centre and moments of a hollow round bar by quadrature over radius, angle and length."""
    x, w = np.polynomial.legendre.leggauss(6)
    r, wr = inner + (outer - inner) * (x + 1) / 2, w * (outer - inner) / 2
    s, ws = start + (end - start) * (x + 1) / 2, w * (end - start) / 2
    angle = np.arange(8) * np.pi / 4
    rr, aa, ss = np.meshgrid(r, angle, s, indexing="ij")
    dm = density * np.einsum("r,a,s->ras", wr * r, np.full(8, np.pi / 4), ws)
    mass = dm.sum()
    centre = (dm * ss).sum() / mass
    x_off = rr * np.cos(aa)
    return mass, centre, (dm * (x_off**2 + (ss - centre) ** 2)).sum(), (dm * rr**2).sum()


def test_tubes_are_the_integral_over_their_steel(chain, inertia):
    arm = chain.manipulator
    nodes = chain.nodes(chain.straight)
    for index, member in enumerate(chain.truss.members):
        if member.role == "actuator":
            continue
        tube = arm.tubes[member.section]
        length = np.linalg.norm(nodes[member.ends[1]] - nodes[member.ends[0]])
        outer = tube.outer_diameter / 2
        wanted = integrate(arm.materials[tube.material].density, outer - tube.wall, outer, 0.0, length)
        found = (inertia.mass[index, 0], inertia.centre[index, 0], *inertia.centroidal[index, 0])
        assert found == pytest.approx(wanted, rel=QUADRATURE)
        assert inertia.mass[index, 1] == 0


def test_cylinders_are_a_barrel_and_a_rod_with_smeared_ends(chain, inertia):
    arm = chain.manipulator
    for index in chain.truss.actuated:
        part = arm.cylinders[chain.truss.members[index].section]
        rho = arm.materials[part.material].density
        shapes = (
            (part.bore / 2, part.bore / 2 + part.barrel_wall, part.eye, part.retracted - part.eye),
            (0.0, part.rod / 2, 0.0, part.rod_length),
        )
        for side, (shape, mass) in enumerate(zip(shapes, (part.barrel_mass(rho), part.rod_mass(rho)), strict=True)):
            bare, centre, across, along = integrate(rho, *shape)
            scale = mass / bare  # heads and piston thicken the whole length
            assert scale > 1
            found = (inertia.mass[index, side], inertia.centre[index, side], *inertia.centroidal[index, side])
            assert found == pytest.approx((mass, centre, across * scale, along * scale), rel=QUADRATURE)


def test_tubes_keep_their_length_when_the_arm_bends(chain, inertia):
    """Lengths are taken in one pose; they must be those of every pose."""
    q = chain.straight + np.tile([0.15, -0.1, 0.01], len(chain.layout.names))
    nodes = chain.nodes(q)
    length = np.linalg.norm(nodes[chain.truss.ends[:, 1]] - nodes[chain.truss.ends[:, 0]], axis=-1)
    tubes = np.setdiff1d(np.arange(len(length)), chain.truss.actuated)
    assert 2 * inertia.centre[tubes, 0] == pytest.approx(length[tubes], rel=1e-12)


def test_moments_about_the_end_follow_from_the_centre(inertia):
    assert inertia.first_moment == pytest.approx(inertia.mass * inertia.centre)
    assert inertia.about_end[0, 0] == pytest.approx(
        inertia.centroidal[0, 0, 0] + inertia.mass[0, 0] * inertia.centre[0, 0] ** 2
    )
    with pytest.raises(ValueError, match="read-only"):
        inertia.mass[0, 0] = 1.0


def test_plate_is_a_uniform_triangle(chain):
    """A quarter million small triangles, summed."""
    plate, side = make_plate_inertia(chain.manipulator), chain.manipulator.face_side
    corners = side * np.array([[0.5, -0.5 / 3**0.5], [0.0, 1 / 3**0.5], [-0.5, -0.5 / 3**0.5]])
    n = 500
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    up, down = i + j < n, i + j < n - 1
    a = np.concatenate([(i[up] + 1 / 3) / n, (i[down] + 2 / 3) / n])
    b = np.concatenate([(j[up] + 1 / 3) / n, (j[down] + 2 / 3) / n])
    points = corners[0] * (1 - a - b)[:, None] + corners[1] * a[:, None] + corners[2] * b[:, None]
    assert len(points) == n**2
    assert points.mean(axis=0) == pytest.approx([0, 0], abs=1e-12)
    x, y = plate.mass * (points**2).mean(axis=0)
    assert plate.second_moments == pytest.approx((x, y, 0.0), rel=1e-4, abs=1e-12)
    assert plate.moments == pytest.approx((y, x, x + y), rel=1e-4)


def test_radii_are_half_the_outer_diameters(chain):
    radii = member_radii(chain)
    for radius, member in zip(radii, chain.truss.members, strict=True):
        if member.role == "actuator":
            part = chain.manipulator.cylinders[member.section]
            assert radius == part.bore / 2 + part.barrel_wall
        else:
            assert 2 * radius == chain.manipulator.tubes[member.section].outer_diameter
