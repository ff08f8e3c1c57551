"""The longeron-actuated octahedron, a Stewart platform (section 3.4), as a kind of module, see `sets`.

Inputs are poses (x, y, z, roll, pitch, yaw); legs are the six longerons, static ones included.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Mask
from vgtsim.compilation import compiled
from vgtsim.description import Octahedral
from vgtsim.errors import AssemblyError, SingularityError
from vgtsim.geometry import copy_matrix, copy_row
from vgtsim.kinematics.modules import octahedron as single
from vgtsim.kinematics.modules.sets import Chord, Groups, Kind, ModuleSet, PlannedMember, naming
from vgtsim.kinematics.modules.stroke_boxes import search_strokes
from vgtsim.kinematics.roll_pitch_yaw import pose_parameters, pose_transform, smallest_turn

_KEPT = 1e-9  # m: rounding of a pose that was meant to lie in the module's subspace
_PITCH = np.radians(80.0)  # from which roll and yaw are too nearly the same turn


@compiled
def fill_poses(
    x: Array,
    figures: Array,
    straight: Array,
    marks: Mask,
    frame: Array,
    motion: Array,
    length: Array,
    slope: Array,
    inner: Array,  # noqa: ARG001  # there are none
    inner_slope: Array,  # noqa: ARG001
) -> None:
    """See `Fill`; figures are lower ends in B, upper ends in T, static lengths, and the sign of the mode's determinant."""
    pose, own, turn, J = np.empty(6), np.empty((3, 4)), np.zeros((6, 6)), np.empty((6, 6))
    for i in range(x.shape[0]):
        for m in range(x.shape[1]):
            placed = True
            for j in range(6):
                placed = placed and np.isfinite(x[i, m, j])
            copy_row(x[i, m] if placed else straight[m], pose)
            _place(pose, own)
            if frame.size:
                copy_matrix(own, frame[i, m])
            if motion.size or length.size:
                # the first three inputs move the origin; roll turns about X of T, yaw about Z of B, pitch square to both
                turn[0, 3] = turn[1, 4] = turn[2, 5] = turn[5, 2] = 1.0
                turn[3, 0], turn[3, 1], turn[3, 2] = own[0, 0], own[1, 0], own[2, 0]
                turn[4, 0], turn[4, 1] = -np.sin(pose[5]), np.cos(pose[5])
            if motion.size:
                copy_matrix(turn, motion[i, m])
            marks[i, m, 0] = marks[i, m, 1] = placed
            if length.size:
                off = _reach(own, turn, figures[m], length[i, m], slope[i, m])
                copy_matrix(slope[i, m], J)
                marks[i, m, 2] = placed and off <= _KEPT
                marks[i, m, 3] = placed and abs(pose[4]) < _PITCH and _determinant(J) * figures[m, 42] > 0


@compiled
def _place(pose: Array, frame: Array) -> None:
    """As `roll_pitch_yaw.pose_transform`."""
    cg, cb, ca = np.cos(pose[3]), np.cos(pose[4]), np.cos(pose[5])
    sg, sb, sa = np.sin(pose[3]), np.sin(pose[4]), np.sin(pose[5])
    frame[0, 0], frame[0, 1], frame[0, 2] = ca * cb, ca * sb * sg - sa * cg, ca * sb * cg + sa * sg
    frame[1, 0], frame[1, 1], frame[1, 2] = sa * cb, sa * sb * sg + ca * cg, sa * sb * cg - ca * sg
    frame[2, 0], frame[2, 1], frame[2, 2] = -sb, cb * sg, cb * cg
    frame[0, 3], frame[1, 3], frame[2, 3] = pose[0], pose[1], pose[2]


@compiled
def _reach(frame: Array, turn: Array, figures: Array, length: Array, slope: Array) -> float:
    """Lengths of all six longerons by 3.27, static ones too as the pose has them; returns their greatest error, m."""
    arm, unit, off = np.empty(3), np.empty(3), 0.0
    for leg in range(6):
        square = 0.0
        for k in range(3):
            arm[k] = 0.0
            for j in range(3):
                arm[k] += frame[k, j] * figures[18 + 3 * leg + j]
            unit[k] = frame[k, 3] + arm[k] - figures[3 * leg + k]
            square += unit[k] * unit[k]
        length[leg] = np.sqrt(square)
        for k in range(3):
            unit[k] /= length[leg]
        x, y, z = unit[0], unit[1], unit[2]
        for j in range(6):
            slope[leg, j] = x * turn[j, 3] + y * turn[j, 4] + z * turn[j, 5]
            slope[leg, j] += (arm[1] * z - arm[2] * y) * turn[j, 0]
            slope[leg, j] += (arm[2] * x - arm[0] * z) * turn[j, 1] + (arm[0] * y - arm[1] * x) * turn[j, 2]
        if np.isfinite(figures[36 + leg]):
            off = max(off, abs(length[leg] - figures[36 + leg]))
    return off


@compiled
def _determinant(a: Array) -> float:
    """Determinant of a square matrix, which is overwritten, with the greatest pivots of the columns."""
    value, n = 1.0, len(a)
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        if a[best, k] == 0:
            return 0.0
        if best != k:
            value = -value
            for j in range(n):
                a[k, j], a[best, j] = a[best, j], a[k, j]
        value *= a[k, k]
        for i in range(k + 1, n):
            share = a[i, k] / a[k, k]
            for j in range(k, n):
                a[i, j] -= share * a[k, j]
    return value


@dataclass(frozen=True, eq=False)
class Octahedra(ModuleSet):
    """Longeron-actuated octahedra, each with its geometry."""

    geometries: tuple[single.OctahedronGeometry, ...]
    fill = staticmethod(fill_poses)
    inputs = 6
    units = ("m", "m", "m", "rad", "rad", "rad")
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
    def figures(self) -> Array:
        """Ends of the legs, static lengths, and the sign of the determinant of the straight legs' slopes, (M, 43)."""
        ends = [item.reshape(len(self.names), -1) for item in self._ends]
        # the determinant by the inputs is that by the twist times the cosine of the pitch, which is positive
        sign = np.sign(np.linalg.det(self.conditioned(self.straight)))
        return np.concatenate([*ends, self._static, sign[:, None]], axis=1)

    def refuse(self, x: Array) -> Exception:
        """A static longeron would need another length: the pose is outside the module's subspace."""
        if not np.all(np.isfinite(x)):
            return ValueError(f"a pose of {', '.join(self.names)} is no number")
        lengths = self.at(x).legs[0]
        error = np.abs(np.nan_to_num(lengths - self._static))  # zero for actuated ones
        worst = np.unravel_index(int(np.argmax(error)), error.shape)
        module, leg = int(worst[-2]), int(worst[-1])
        freedom = int(self.actuated[module].sum())
        detail = f"pose outside the {freedom}-dimensional subspace: static longeron l{leg + 1} would be"
        return AssemblyError(self.names[module], float(error[worst]), f"{detail} {lengths[worst]:.6g} m")

    @cached_property
    def _alike(self) -> tuple[tuple[single.OctahedronGeometry, list[int]], ...]:
        """Modules by their dimensions: those that are alike are followed together."""
        groups: dict[single.OctahedronGeometry, list[int]] = {}
        for m, geometry in enumerate(self.geometries):
            groups.setdefault(geometry, []).append(m)
        return tuple(groups.items())

    def attempt(self, lengths: Array, start: Array | None = None) -> tuple[Array, Array]:
        """As `octahedron.advance`, of longerons, (..., M, 6), m: poses, (..., M, 6), and the fraction of the way, (..., M)."""
        x, reached = np.empty(lengths.shape), np.empty(lengths.shape[:-1])
        near = np.broadcast_to(self.straight if start is None else start, lengths.shape)
        for geometry, mine in self._alike:
            wanted = lengths[..., mine, :]
            begin = pose_transform(near[..., mine, :].reshape(-1, 6))
            R, P, part = single.advance(geometry, wanted.reshape(-1, 6), begin)
            x[..., mine, :] = pose_parameters(R, P).reshape(wanted.shape)
            reached[..., mine] = part.reshape(wanted.shape[:-1])
        return x, reached

    def require_closing(self, lengths: Array) -> None:
        """Refuse two longerons that do not meet over their edge."""
        for m, (name, geometry) in enumerate(zip(self.names, self.geometries, strict=True)):
            with naming(name):
                single.closure(geometry, lengths[..., m, :])

    def tell_end(self, lengths: Array, start: Array | None, part: float) -> SingularityError:
        """A singularity, with the longeron that loses most of its length change."""
        geometry, name, (R, P) = self.geometries[0], self.names[0], pose_transform(self.attempt(lengths, start)[0][0])
        value, leg = single.singularity(geometry, R, P)
        role = "longeron" if geometry.static[leg] is not None else "actuator"
        gap = np.abs(single.lengths(geometry, R, P) - lengths[0]).max()
        return SingularityError(name, value, f"{name}/{role}/{leg + 1}", float(gap), part)

    def conditioned(self, x: Array) -> Array:
        """dl/dtwist in `twist_units`."""
        (lower, upper), (R, P) = self._ends, pose_transform(x)
        J = single.leg_jacobian(lower, upper @ np.swapaxes(R, -1, -2) + P[..., None, :], P)[1]
        return J / np.array([geometry.twist_units for geometry in self.geometries])[:, None]

    def check_strokes(self, low: Array, high: Array) -> None:
        """By a search, see `search_strokes`."""
        search_strokes(self, low, high)

    def is_free(self, m: int) -> bool:
        """Six actuators give the top any pose; static longerons do not follow a swing."""
        return bool(np.all(self.actuated[m]))

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

    def extend(self, m: int | slice, x: Array, extension: ArrayLike) -> Array:  # noqa: ARG002
        """The centroid of the top moves along its direction from the base's."""
        reach = np.asarray(extension, float)[..., None]
        place = x[..., :3] * reach / np.linalg.norm(x[..., :3], axis=-1, keepdims=True)
        return np.concatenate([place, x[..., 3:]], axis=-1)

    def sideways(self, m: int, angle: float) -> Array:
        """The part of the top's centroid across the plane, m, and that of its normal, to first order about the straight."""
        x, y = -np.sin(angle), np.cos(angle)
        cos, sin = np.cos(self.straight[m, 5]), np.sin(self.straight[m, 5])
        return np.array([[x, y, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, x * sin - y * cos, x * cos + y * sin, 0.0]])

    def lay(self, m: int, chord: Chord, share: Array) -> tuple[Array, Array, Array]:
        """The top stands at the begin of the chord, its normal along it, turned by the share."""
        straight = pose_transform(self.straight[m])[0]
        top = smallest_turn(straight[:, 2], chord.direction) @ straight @ share
        return pose_parameters(top, chord.begin), top, chord.begin + chord.length * chord.direction


def make_octahedra(modules: Sequence[Octahedral], side: float) -> Octahedra:
    """The set of described modules and the arm's face side, m; an AssemblyError where straight longerons do not close."""
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
