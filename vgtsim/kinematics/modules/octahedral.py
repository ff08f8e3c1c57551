"""The longeron-actuated octahedron, a Stewart platform (section 3.4), as a kind of module, see `sets`.

Inputs are poses (x, y, z, roll, pitch, yaw); legs are the six longerons, static ones included.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.modules import Octahedral
from vgtsim.errors import AssemblyError, SingularityError
from vgtsim.kinematics.modules import octahedron as single
from vgtsim.kinematics.modules.kind import Groups, Kind, PlannedMember
from vgtsim.kinematics.modules.sets import Chord, Mask, ModuleSet, ModuleState, find_short
from vgtsim.kinematics.modules.stroke_search import search_strokes
from vgtsim.kinematics.roll_pitch_yaw import (
    pose_parameters,
    pose_transform,
    smallest_turn,
)

Array = NDArray[np.float64]

_PITCH = np.radians(80.0)  # from which roll and yaw are too nearly the same turn


@dataclass(frozen=True, eq=False)
class Poses(ModuleState):
    """Kinematics of octahedra."""

    modules: Octahedra

    @cached_property
    def placed(self) -> Mask:
        """Poses that are numbers."""
        return np.asarray(np.logical_and.reduce(np.isfinite(self.x), axis=-1))

    @cached_property
    def _pose(self) -> Array:
        """Shape (b, M, 6); straight where the input is no number."""
        placed = self.placed
        return self.x if placed.all() else np.where(placed[..., None], self.x, self.modules.straight)

    @cached_property
    def kept(self) -> Mask:
        """Poses in which static longerons have their length."""
        return self.placed & np.all(self.modules.find_errors(self.legs[0]) <= single.STATIC_TOLERANCE, axis=-1)

    @cached_property
    def valid(self) -> Mask:
        """Poses short of a singularity: beyond one the determinant has the other sign, and the mode is another."""
        sign = np.linalg.det(self.legs[1]) * self.modules.sign > 0
        return self.placed & (np.abs(self._pose[..., 4]) < _PITCH) & sign

    @cached_property
    def transform(self) -> tuple[Array, Array]:
        """As `roll_pitch_yaw.pose_transform`."""
        return pose_transform(self._pose)

    @cached_property
    def twist(self) -> tuple[Array, Array]:
        """The first three inputs move the origin; roll turns about X of T, yaw about Z of B, pitch square to Z and X."""
        yaw = self._pose[..., 5]
        spin, slide = np.zeros((2, *self.x.shape, 3))
        spin[..., 3, :] = self.transform[0][..., 0]
        spin[..., 4, 0], spin[..., 4, 1] = -np.sin(yaw), np.cos(yaw)
        spin[..., 5, 2] = slide[..., 0, 0] = slide[..., 1, 1] = slide[..., 2, 2] = 1.0
        return spin, slide

    @cached_property
    def legs(self) -> tuple[Array, Array]:
        """Lengths of all six longerons by 3.27, static ones too as the pose has them."""
        length, J = self.modules.leg_slopes(*self.transform)
        return length, np.concatenate([J[..., :3], J[..., 3:] @ self.twist[0][..., 3:, :].swapaxes(-1, -2)], axis=-1)


@dataclass(frozen=True, eq=False)
class Octahedra(ModuleSet):
    """Longeron-actuated octahedra.

    Attributes:
        geometries: One each.
    """

    geometries: tuple[single.OctahedronGeometry, ...]
    inputs = 6
    units = ("m", "m", "m", "rad", "rad", "rad")
    sizable = False  # each longeron names a section of its own
    sections_key = "longerons"

    @cached_property
    def actuated(self) -> Mask:
        """Longerons with a cylinder."""
        return np.array([[length is None for length in geometry.static] for geometry in self.geometries])

    @cached_property
    def _static(self) -> Array:
        """Lengths of the static longerons, not a number for the actuated ones, shape (M, 6), m."""
        rows = [[np.nan if item is None else item for item in geometry.static] for geometry in self.geometries]
        return np.array(rows)

    @cached_property
    def _ends(self) -> tuple[Array, Array]:
        """Lower ends in B and upper ends in T, each shape (M, 6, 3), m."""
        lower = np.array([geometry.base_nodes[single.LEGS[:, 0]] for geometry in self.geometries])
        return lower, np.array([geometry.top_nodes[single.LEGS[:, 1]] for geometry in self.geometries])

    @cached_property
    def sign(self) -> Array:
        """Sign of the determinant of the legs' derivatives in the straight pose, shape (M,)."""
        return np.sign(np.linalg.det(self.straight_legs[1]))

    def at(self, x: Array) -> Poses:
        """As `Poses`."""
        return Poses(x, self)

    def find_errors(self, lengths: Array) -> Array:
        """How far static longerons are off their length, shape (..., M, 6), m; zero for actuated ones."""
        return np.abs(np.nan_to_num(lengths - self._static))

    def refuse(self, x: Array) -> Exception:
        """A static longeron would need another length: the pose is outside the module's subspace."""
        if not np.all(np.isfinite(x)):
            return ValueError(f"a pose of {', '.join(self.names)} is no number")
        lengths = self.at(x).legs[0]
        error = self.find_errors(lengths)
        worst = np.unravel_index(int(np.argmax(error)), error.shape)
        module, leg = int(worst[-2]), int(worst[-1])
        freedom = int(self.actuated[module].sum())
        detail = f"pose outside the {freedom}-dimensional subspace: static longeron l{leg + 1} would be"
        return AssemblyError(self.names[module], float(error[worst]), f"{detail} {lengths[worst]:.6g} m")

    def leg_slopes(self, R: Array, P: Array) -> tuple[Array, Array]:
        """As `octahedron.leg_jacobian`, of all modules in poses of shape (..., M, 3, 3) and (..., M, 3)."""
        lower, upper = self._ends
        return single.leg_jacobian(lower, upper @ np.swapaxes(R, -1, -2) + P[..., None, :], P)

    def one(self, m: int) -> Octahedra:
        """The set of module m alone."""
        return Octahedra(self.names[m : m + 1], self.straight[m : m + 1], self.geometries[m : m + 1])

    def dimensions(self, m: int) -> object:
        """As `OctahedronGeometry`."""
        return self.geometries[m]

    @cached_property
    def _alike(self) -> tuple[tuple[single.OctahedronGeometry, list[int]], ...]:
        """Modules by their dimensions: those that are alike are followed together."""
        groups: dict[single.OctahedronGeometry, list[int]] = {}
        for m, geometry in enumerate(self.geometries):
            groups.setdefault(geometry, []).append(m)
        return tuple(groups.items())

    def attempt(self, lengths: Array, start: Array | None = None) -> tuple[Array, Array]:
        """As `octahedron.advance`: poses, shape (..., M, 6), and the fraction of the way covered, shape (..., M).

        Lengths are of all longerons, shape (..., M, 6), m; starts are poses, absent for the straight ones.
        """
        x, reached = np.empty(lengths.shape), np.empty(lengths.shape[:-1])
        near = np.broadcast_to(self.straight if start is None else start, lengths.shape)
        for geometry, mine in self._alike:
            wanted = lengths[..., mine, :]
            begin = pose_transform(near[..., mine, :].reshape(-1, 6))
            R, P, part = single.advance(geometry, wanted.reshape(-1, 6), begin)
            x[..., mine, :] = pose_parameters(R, P).reshape(wanted.shape)
            reached[..., mine] = part.reshape(wanted.shape[:-1])
        return x, reached

    def solve(self, lengths: Array, start: Array | None = None) -> Array:
        """As `attempt`, but all lengths must be reached.

        Raises:
            AssemblyError: A longeron pair does not close; the module is named.
            SingularityError: A singularity lies between.
        """
        for m, (name, geometry) in enumerate(zip(self.names, self.geometries, strict=True)):
            try:
                single.closure(geometry, lengths[..., m, :])
            except AssemblyError as error:
                raise AssemblyError(name, error.residual, str(error)) from None
        x, reached = self.attempt(lengths, start)
        worst = find_short(reached)
        if worst is not None:
            geometry, name = self.geometries[worst[-1]], self.names[worst[-1]]
            R, P = pose_transform(x[worst])
            value, leg = single.singularity(geometry, R, P)
            role = "longeron" if geometry.static[leg] is not None else "actuator"
            gap = np.abs(single.lengths(geometry, R, P) - lengths[worst]).max()
            raise SingularityError(name, value, f"{name}/{role}/{leg + 1}", float(gap), float(reached[worst]))
        return x

    def conditioned(self, x: Array) -> Array:
        """dl/dtwist with rotations in units of the top nodes' radius."""
        scale = np.ones((len(self.names), 6))
        scale[:, 3:] = np.array([geometry.radius for geometry in self.geometries])[:, None]
        return self.leg_slopes(*pose_transform(x))[1] / scale[:, None, :]

    def check_strokes(self, low: Array, high: Array) -> None:
        """By a search, see `search_strokes`."""
        search_strokes(self, low, high)

    @cached_property
    def swings(self) -> bool:
        """Only with six actuators: static longerons do not follow a swing."""
        return bool(np.all(self.actuated))

    def swing(self, x: Array, turn: Array) -> Array:
        """The position turns, and so does the axis of the turn of the top."""
        R, P = pose_transform(x)
        return pose_parameters(turn @ R @ np.swapaxes(turn, -1, -2), (turn @ P[..., None])[..., 0])

    def bend(self, angle: Array, half: Array) -> Array:  # noqa: ARG002
        """One pose of many: the top turns about the axis across the bend, its centroid stands in the direction halfway."""
        R, P = pose_transform(self.straight)
        mirror = np.eye(3) - 2 * half[..., :, None] * half[..., None, :]
        mirror[..., 2] *= -1
        return pose_parameters(mirror @ R, np.linalg.norm(P, axis=-1)[:, None] * half)

    def extend(self, m: int, x: Array, extension: float) -> Array:  # noqa: ARG002
        """The centroid of the top moves along its direction from the base's."""
        return np.concatenate([x[:3] * extension / np.linalg.norm(x[:3]), x[3:]])

    def sideways(self, m: int, angle: float) -> Array:
        """The part of the top's centroid across the plane, m, and that of its normal, to first order about the straight."""
        x, y = -np.sin(angle), np.cos(angle)
        cos, sin = np.cos(self.straight[m, 5]), np.sin(self.straight[m, 5])
        return np.array([[x, y, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, x * sin - y * cos, x * cos + y * sin, 0.0]])

    def lies(self, m: int) -> bool:
        """Six actuators give the top any pose."""
        return bool(np.all(self.actuated[m]))

    def lay(self, m: int, chord: Chord, share: Array) -> tuple[Array, Array, Array]:
        """The top stands at the begin of the chord, its normal along it, turned by the share."""
        straight = pose_transform(self.straight[m])[0]
        top = smallest_turn(straight[:, 2], chord.direction) @ straight @ share
        return pose_parameters(top, chord.begin), top, chord.begin + chord.length * chord.direction


def make_octahedra(modules: Sequence[Octahedral], side: float) -> Octahedra:
    """The set of described modules; faces that are not given are the arm's, of a side in m.

    Raises:
        AssemblyError: The longerons of a straight pose do not close.
    """
    geometries = tuple(octahedron_geometry(module, side) for module in modules)
    poses = [
        pose_parameters(
            *single.forward(geometry, np.array([item.length or module.straight for item in module.longerons]))
        )
        for geometry, module in zip(geometries, modules, strict=True)
    ]
    return Octahedra(tuple(module.name for module in modules), np.array(poses), geometries)


def octahedron_geometry(module: Octahedral, side: float) -> single.OctahedronGeometry:
    """Fixed dimensions of a described module; faces that are not given are the arm's, of a side in m."""
    base, top = module.faces(side)
    return single.OctahedronGeometry(base, top, tuple(longeron.length for longeron in module.longerons))


def plan_members(module: Octahedral, groups: Groups) -> list[PlannedMember]:
    """l1 to l6, each an actuator or a longeron."""
    base, top = groups["base"], groups["top"]
    return [
        PlannedMember(
            "longeron" if longeron.cylinder is None else "actuator",
            longeron.cylinder or longeron.tube or "",
            base[i],
            top[j],
            number,
        )
        for number, (longeron, (i, j)) in enumerate(zip(module.longerons, single.LEGS.tolist(), strict=True), 1)
    ]


KIND = Kind(plan=plan_members, make_set=make_octahedra)
