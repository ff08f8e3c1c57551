"""Mass, centre and moments of inertia of every member and of the tip plate, from the description alone.

A member is one or two rigid segments on a straight axis. The near segment is measured from the hub at the
member's first node, the far segment from the hub at its second. Tubes are one near segment; a cylinder is a
barrel (near) and a rod (far), whose overlap changes with the stroke while both keep their mass.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import Cylinder, Manipulator, Tube
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.chain import Chain

_Segment = tuple[float, float, float, float]  # mass, centre, transverse and axial moment


@dataclass(frozen=True)
class MemberInertia:
    """Segments of every member; the second axis is near and far, the far one zero for tubes.

    Attributes:
        mass: kg, shape (M, 2).
        centre: Distance of the centre of mass from the segment's own hub, shape (M, 2), m.
        centroidal: Moments of inertia through the centre of mass, about a diameter and about the member's
            axis, shape (M, 2, 2), kg·m².
    """

    mass: Array
    centre: Array
    centroidal: Array

    def __post_init__(self) -> None:
        """Copy the arrays and make them read-only."""
        for item in fields(self):
            value = np.array(getattr(self, item.name), float)
            value.flags.writeable = False
            object.__setattr__(self, item.name, value)

    @property
    def first_moment(self) -> Array:
        """Mass times distance from the own hub, shape (M, 2), kg·m."""
        return self.mass * self.centre

    @property
    def about_end(self) -> Array:
        """Moment of inertia about a diameter through the own hub, shape (M, 2), kg·m²."""
        return self.centroidal[..., 0] + self.mass * self.centre**2


@dataclass(frozen=True)
class PlateInertia:
    """The tip plate, without hubs, in frame T of the last face: centred on its origin.

    Attributes:
        mass: kg.
        second_moments: Integrals of x², y² and z² over the mass, shape (3,), kg·m².
    """

    mass: float
    second_moments: tuple[float, float, float]

    @property
    def moments(self) -> tuple[float, float, float]:
        """Principal moments of inertia about X, Y and Z of T, shape (3,), kg·m²."""
        x, y, z = self.second_moments
        return y + z, x + z, x + y


def make_member_inertia(chain: Chain, *, split: bool = False, lumped: bool = False) -> MemberInertia:
    """Segments of every member of an arm.

    A tube runs from hub to hub. A barrel is uniform between its eye and its mouth, the heads smeared over it; a rod is
    uniform and solid, the piston smeared over it. `split` cuts a tube in the middle into a near and a far half, as an
    elastic one is. `lumped` puts all mass in the hubs, see `make_hub_masses`.
    """
    manipulator, members = chain.manipulator, chain.truss.members
    segments = np.zeros((len(members), 2, 4))
    if lumped:
        return MemberInertia(segments[..., 0], segments[..., 1], segments[..., 2:])
    for row, member, length in zip(segments, members, chain.member_lengths, strict=True):
        if member.role == "actuator":
            row[:] = _cylinder_segments(manipulator, manipulator.cylinders[member.section])
        elif split:
            row[:] = _tube_segment(manipulator, manipulator.tubes[member.section], float(length) / 2)
        else:
            row[0] = _tube_segment(manipulator, manipulator.tubes[member.section], float(length))
    return MemberInertia(segments[..., 0], segments[..., 1], segments[..., 2:])


def make_block_inertia(chain: Chain) -> MemberInertia:
    """Work out the posts of the joint blocks, which run from the middle of one ball to that of the other.

    One near segment each, in the order of `Truss.rings`, shapes (3 R, 2): the balls' masses stand at the nodes, their
    moments of inertia about themselves are the post's.
    """
    manipulator, truss = chain.manipulator, chain.truss
    segments = np.zeros((truss.rings.shape[0] * 3, 2, 4))
    owners = truss.node_module[truss.rings[:, :, 1].ravel()].tolist()
    balls = 2 * 0.4 * manipulator.hub_mass * manipulator.hub.radius**2
    for row, module in zip(segments, owners, strict=True):
        block, height = manipulator.block_of(module), manipulator.modules[module].offset
        mass = manipulator.materials[block.material].density * np.pi / 4 * block.diameter**2 * height
        row[0] = _uniform_segment(mass, 0.0, height, block.diameter, 0.0)
        row[0, 2:] += balls
    return MemberInertia(segments[..., 0], segments[..., 1], segments[..., 2:])


def make_hub_masses(chain: Chain, *, lumped: bool = False) -> Array:
    """Mass of every node, shape (N,), kg; zero at feet and heads of joint blocks, whose balls are the blocks'.

    `lumped` puts the members' mass in their hubs: half of each tube in either, a barrel in the near one, a rod in the
    far one.

    Raises:
        DescriptionError: Mass is lumped in an arm with joint blocks.
    """
    manipulator, truss = chain.manipulator, chain.truss
    if lumped and len(truss.rings):
        modules = sorted({manipulator.modules[m].name for m in truss.node_module[truss.rings[:, 0, 1]]})
        found = f"mass of members lumped, with joint offsets in {', '.join(modules)}"
        raise DescriptionError(
            None, "simulation.member_mass", found, "distributed: blocks and pinned cylinders have mass"
        )
    mass = manipulator.hub_mass * truss.hubs.astype(float)
    if lumped:
        np.add.at(mass, truss.ends, make_member_inertia(chain, split=True).mass)
    return mass


def make_line_masses(chain: Chain, density: float) -> Array:
    """Mass that a line of conveyance puts on each node, shape (N,), kg; its mass per length is `density`, kg/m.

    Each face carries the line halfway to its neighbours in the straight arm, a third on each node. The upper half of the first
    span hangs from the line in the mast, which hangs from above ground.
    """
    mass, faces = np.zeros(len(chain.truss.nodes)), chain.truss.faces
    span = np.linalg.norm(np.diff(chain.frames(chain.straight)[1], axis=0), axis=-1)
    held = density / 2 * (span + np.append(span[1:], 0.0))
    np.add.at(mass, faces[1:], held[:, None] / 3)
    return mass


def make_plate_inertia(manipulator: Manipulator) -> PlateInertia:
    """The tip plate: a uniform, thin equilateral triangle of the face side."""
    mass, side = manipulator.tip_plate_mass, manipulator.face_side
    plane = mass * side**2 / 24
    return PlateInertia(mass, (plane, plane, 0.0))


def member_radii(chain: Chain) -> Array:
    """Outer radius of every member, shape (M,), m: of the tube, or of the barrel of an actuator."""
    tubes, cylinders = chain.manipulator.tubes, chain.manipulator.cylinders
    return np.array(
        [
            cylinders[member.section].barrel_diameter / 2
            if member.role == "actuator"
            else tubes[member.section].outer_diameter / 2
            for member in chain.truss.members
        ]
    )


def _uniform_segment(mass: float, start: float, end: float, outer: float, inner: float) -> _Segment:
    """Uniform round segment between two distances from its hub."""
    square = (outer**2 + inner**2) / 4  # sum of the squared radii
    return mass, (start + end) / 2, mass * (square / 4 + (end - start) ** 2 / 12), mass * square / 2


def _tube_segment(manipulator: Manipulator, tube: Tube, length: float) -> _Segment:
    mass = manipulator.materials[tube.material].density * tube.area * length
    return _uniform_segment(mass, 0.0, length, tube.outer_diameter, tube.inner_diameter)


def _cylinder_segments(manipulator: Manipulator, cylinder: Cylinder) -> tuple[_Segment, _Segment]:
    density = manipulator.materials[cylinder.material].density
    barrel = _uniform_segment(
        cylinder.barrel_mass(density), cylinder.eye, cylinder.barrel_length, cylinder.barrel_diameter, cylinder.bore
    )
    return barrel, _uniform_segment(cylinder.rod_mass(density), 0.0, cylinder.rod_length, cylinder.rod, 0.0)
