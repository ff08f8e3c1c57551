"""The symmetric batten-actuated double octahedron (sections 3.5.3 and 3.5.4) as a kind of module, see `sets`.

Inputs are mid-planes (u_x, u_y, d), see `mid_plane`; legs are the three actuators.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Mask
from vgtsim.compilation import compiled
from vgtsim.description import DoubleOctahedral, GeneralDoubleOctahedral
from vgtsim.errors import AssemblyError, SingularityError
from vgtsim.kinematics.closure import angle_jacobian, circle_nodes, circle_tangents, closure_coefficients, edge_lengths
from vgtsim.kinematics.mode_following import follow_squares, worst_direction
from vgtsim.kinematics.modules import mid_plane as double
from vgtsim.kinematics.modules.mid_plane import INWARD
from vgtsim.kinematics.modules.sets import TRIANGLE, Chord, Groups, Kind, ModuleSet, PlannedMember
from vgtsim.kinematics.modules.stroke_boxes import prove_strokes

# given as the fraction covered when lengths were reached with the mid-plane turned over, or past a mid node's circle
_TURNED = 0.999
_FLAT = 1 - 1e-12  # u_x² + u_y² of the normal from which u_z, by which is divided, is no number to rely on
_LOW = 0.98  # the same from which a mid-plane counts as lying flat: the inputs change their meaning at one
_TOUCHING = 1e-12  # least square of the sine at a circle, where a plane only touches it and rates grow without bound

# ends as (base | foot | head | top, corner); L1 to L12 of figure 3.10; without a joint offset foot and head are one
_LONGERONS = (
    *((("base", i), ("foot", j)) for i, j in ((0, 0), (1, 1), (2, 2), (2, 0), (0, 1), (1, 2))),
    *((("head", i), ("top", j)) for i, j in ((1, 0), (2, 1), (0, 2), (0, 0), (1, 1), (2, 2))),
)


@compiled
def fill_mid_planes(
    x: Array,
    figures: Array,
    straight: Array,
    marks: Mask,
    frame: Array,
    motion: Array,
    length: Array,
    slope: Array,
    inner: Array,
    inner_slope: Array,
) -> None:
    """See `Fill`, without trigonometry; figures are altitude, apothem and joint offset."""
    nodes, tangent, rate, turn = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.zeros((3, 3))
    for i in range(x.shape[0]):
        for m in range(x.shape[1]):
            h, apothem, offset = figures[m, 0], figures[m, 1], figures[m, 2]
            leaning = x[i, m, 0] * x[i, m, 0] + x[i, m, 1] * x[i, m, 1]
            placed = leaning < _FLAT and np.isfinite(x[i, m, 2])
            g = x[i, m] if placed else straight[m]
            a, b, d = g[0], g[1], g[2]
            c = np.sqrt(1 - (a * a + b * b))
            way = 2 * d + offset
            if frame.size:
                _mirror(a, b, c, way, frame[i, m])
            if motion.size:
                _turn(a, b, c, way, motion[i, m])
            closed = placed
            for k in range(3):  # (3.28) on the outward branch
                vx, vy = INWARD[k, 0], INWARD[k, 1]
                lean = a * vx + b * vy
                size = np.sqrt(lean * lean + c * c)
                cosine = (d + apothem * lean) / (h * size)
                closed = closed and abs(cosine) < 1
                sine = np.sqrt(max(1 - cosine * cosine, _TOUCHING))
                # that of the normal plus that between normal and radius
                cos, sin = (lean * cosine - c * sine) / size, (c * cosine + lean * sine) / size
                out = h * cos - apothem
                nodes[k, 0], nodes[k, 1], nodes[k, 2] = out * vx, out * vy, h * sin
                tangent[k, 0], tangent[k, 1], tangent[k, 2] = -h * sin * vx, -h * sin * vy, h * cos
                # h (U·v cos phi + u_z sin phi) = d - U·c, differentiated implicitly
                along = h * (cos * c - sin * lean)
                rate[k, 0] = -(nodes[k, 0] - nodes[k, 2] * a / c) / along
                rate[k, 1] = -(nodes[k, 1] - nodes[k, 2] * b / c) / along
                rate[k, 2] = 1.0 / along
            marks[i, m, 0], marks[i, m, 1], marks[i, m, 2] = placed, closed, closed
            marks[i, m, 3] = closed and leaning < _LOW
            if length.size:
                _span(nodes, tangent, rate, length[i, m], slope[i, m])
            for row in range(inner.shape[2]):  # feet, middles of blocks, heads
                rise, k = offset * (row // 3) / 2, row % 3
                inner[i, m, row, 0] = nodes[k, 0] + rise * a
                inner[i, m, row, 1] = nodes[k, 1] + rise * b
                inner[i, m, row, 2] = nodes[k, 2] + rise * c
            if inner_slope.size:
                turn[0, 0] = turn[1, 1] = 1.0
                turn[2, 0], turn[2, 1] = -a / c, -b / c
                _slide(tangent, rate, turn, offset, inner_slope[i, m])


@compiled
def _slide(tangent: Array, rate: Array, turn: Array, offset: float, slope: Array) -> None:
    """Derivatives of the inner nodes: feet slide along their tangents, the others turn too."""
    for row in range(len(slope)):
        rise, k = offset * (row // 3) / 2, row % 3
        for axis in range(3):
            for j in range(3):
                slope[row, axis, j] = tangent[k, axis] * rate[k, j] + rise * turn[axis, j]


@compiled
def _mirror(a: float, b: float, c: float, way: float, frame: Array) -> None:
    """R_BT = (I - 2 U Uᵀ) diag(1, 1, -1) and P_BT = (2 d + Ljo) U: equations 3.52 to 3.54 in closed form."""
    frame[0, 0], frame[0, 1], frame[0, 2], frame[0, 3] = 1 - 2 * a * a, -2 * a * b, 2 * a * c, way * a
    frame[1, 0], frame[1, 1], frame[1, 2], frame[1, 3] = -2 * a * b, 1 - 2 * b * b, 2 * b * c, way * b
    frame[2, 0], frame[2, 1], frame[2, 2], frame[2, 3] = -2 * a * c, -2 * b * c, 2 * c * c - 1, way * c


@compiled
def _turn(a: float, b: float, c: float, way: float, motion: Array) -> None:
    """[omega]x = dR Rᵀ with omega = 2 U x dU."""
    p, q = a / c, b / c  # -dU_z by u_x and u_y
    across = 2 * a * q
    motion[0, 0], motion[0, 1], motion[0, 2] = -across, 2 * (c + a * p), -2 * b
    motion[0, 3], motion[0, 4], motion[0, 5] = way, 0.0, -way * p
    motion[1, 0], motion[1, 1], motion[1, 2] = -2 * (b * q + c), across, 2 * a
    motion[1, 3], motion[1, 4], motion[1, 5] = 0.0, way, -way * q
    motion[2, 0], motion[2, 1], motion[2, 2] = 0.0, 0.0, 0.0
    motion[2, 3], motion[2, 4], motion[2, 5] = 2 * a, 2 * b, 2 * c


@compiled
def _span(nodes: Array, tangent: Array, rate: Array, length: Array, slope: Array) -> None:
    """Distances n4 n5, n5 n6, n6 n4 and their slopes, from nodes, their tangents and the rates of their angles."""
    for k in range(3):
        ahead = (k + 1) % 3
        x, y, z = nodes[ahead, 0] - nodes[k, 0], nodes[ahead, 1] - nodes[k, 1], nodes[ahead, 2] - nodes[k, 2]
        length[k] = size = np.sqrt(x * x + y * y + z * z)
        far = (x * tangent[ahead, 0] + y * tangent[ahead, 1] + z * tangent[ahead, 2]) / size
        near = (x * tangent[k, 0] + y * tangent[k, 1] + z * tangent[k, 2]) / size
        for j in range(3):
            slope[k, j] = far * rate[ahead, j] - near * rate[k, j]


@dataclass(frozen=True, eq=False)
class DoubleOctahedra(ModuleSet):
    """Symmetric double octahedra, whose geometry has figures of shape (M,); all of them or none have a joint offset."""

    geometry: double.DoubleOctahedronGeometry
    fill = staticmethod(fill_mid_planes)
    inputs = 3
    units = ("dimensionless", "dimensionless", "m")
    leans = stows = True

    @cached_property
    def inner_count(self) -> int:
        """Three mid nodes; with a joint offset the feet, middles and heads of three joint blocks."""
        return 9 if np.any(self.geometry.joint_offset > 0) else 3

    @cached_property
    def figures(self) -> Array:
        """Altitude, apothem and joint offset of each, shape (M, 3), m."""
        own = self.geometry
        return np.stack([own.height, own.apothem, own.joint_offset], axis=-1)

    def refuse(self, x: Array) -> Exception:
        """A normal in the base plane, or a mid-plane that misses a circle, by the distance in m."""
        leaning = x[..., 0] ** 2 + x[..., 1] ** 2
        if not np.all(leaning < _FLAT):
            most = np.max(leaning, where=~np.isnan(leaning), initial=0.0)
            return ValueError(f"mid-plane normal lies in the base plane: u_x² + u_y² = {most:.4g}, below 1")
        miss = double.find_misses(self.geometry, x)
        m = int(np.argmax(np.any(miss.reshape(-1, len(self.names)) >= 0, axis=0)))
        return AssemblyError(self.names[m], float(np.max(miss[..., m])), "mid-plane too far")

    def angles(self, x: Array) -> Array:
        """Angles phi of the mid nodes, (..., M, 3), rad; an AssemblyError names a module whose plane misses a circle."""
        if np.any(double.find_misses(self.geometry, x) > 0):
            raise self.refuse(x)
        return double.angles(self.geometry, x)

    def attempt(self, lengths: Array, start: Array | None = None) -> tuple[Array, Array]:
        """Conventional forward solution of lengths, shape (..., M, 3), m; each step is proved to stay on the mode of the start.

        The start has shape (..., M, 3); absent for the straight modules with three equal actuators of the mean length.
        Returns mid-planes, shape (..., M, 3), and the fraction of the way covered, shape (..., M).
        """
        phi, reached = self._follow(lengths, start)
        x = double.midplane_from_angles(self.geometry, phi)
        outward = np.sum(circle_tangents(self.geometry.circles, phi) * double.normal(x)[..., None, :], axis=-1) < 0
        sound = np.all(outward, axis=-1) & double.upright(self.geometry, phi)
        return x, np.where(sound, reached, np.minimum(reached, _TURNED))

    def _follow(self, lengths: Array, start: Array | None) -> tuple[Array, Array]:
        """Angles, shape (..., M, 3), rad, and the fraction of the way covered, shape (..., M)."""
        begin = double.straight_angles(self.geometry, lengths) if start is None else self.angles(start)
        begin = np.broadcast_to(begin, lengths.shape)
        first = edge_lengths(circle_nodes(self.geometry.circles, begin))
        C = closure_coefficients(self.geometry.circles, first).reshape(5, 3, -1)
        change = (first**2 - lengths**2).reshape(-1, 3).T
        result = follow_squares(C, change, begin.reshape(-1, 3))
        return result.phi.reshape(lengths.shape), result.reached.reshape(lengths.shape[:-1])

    def require_closing(self, lengths: Array) -> None:
        """Refuse three actuators that do not make a triangle."""
        excess = 2 * np.max(lengths, axis=-1) - np.sum(lengths, axis=-1)
        if np.any(~(excess < 0)):
            worst = np.unravel_index(int(np.argmax(excess)), excess.shape)
            detail = f"actuators of {np.array2string(lengths[worst], precision=4)} m make no triangle"
            raise AssemblyError(self.names[worst[-1]], float(excess[worst]), detail)

    def tell_end(self, lengths: Array, start: Array | None, part: float) -> SingularityError:
        """A singularity of the cell below the mid-plane, or a mid-plane that turns too far."""
        name, circles, phi = self.names[0], self.geometry.circles, self._follow(lengths, start)[0]
        value, row = worst_direction(angle_jacobian(circles, phi)[0] / self.geometry.height[0])
        gap = np.abs(edge_lengths(circle_nodes(circles, phi)) - lengths).max()
        turned = "the mid-plane turns tangent to a mid node's circle"
        reason = f"{turned if part == _TURNED else 'a singularity lies'} on the way to actuators of"
        reason = f"{reason} {np.array2string(lengths[0], precision=4)} m"
        return SingularityError(name, value, f"{name}/actuator/{row + 1}", float(gap), part, reason)

    def conditioned(self, x: Array) -> Array:
        """dl/dphi over the altitude of the longeron triangles."""
        return angle_jacobian(self.geometry.circles, self.angles(x)) / self.geometry.height[..., None, None]

    def check_strokes(self, low: Array, high: Array) -> None:
        """By proof, see `prove_strokes`."""
        prove_strokes(self, low, high)

    def is_free(self, m: int) -> bool:  # noqa: ARG002
        """A mid-plane's normal turns about Z, and puts the end of what follows it at any point."""
        return True

    def swing(self, x: Array, turn: Array) -> Array:
        """The normal turns, and the distance stays."""
        turned = (turn[..., :2, :2] @ x[..., :2, None])[..., 0]
        return np.concatenate([turned, np.broadcast_to(x[..., 2:], (*turned.shape[:-1], 1))], axis=-1)

    def bend(self, angle: Array, half: Array) -> Array:
        """The normal midway between the faces is the mid-plane's."""
        return np.concatenate([half[..., :2], np.broadcast_to(self.straight[:, 2:], (*angle.shape, 1))], axis=-1)

    def extend(self, m: int | slice, x: Array, extension: ArrayLike) -> Array:
        """The mid-plane stands halfway, the joint offset left out."""
        distance = (np.asarray(extension, float) - self.geometry.joint_offset[m]) / 2
        return np.concatenate([x[..., :2], distance[..., None]], axis=-1)

    def sideways(self, m: int, angle: float) -> Array:  # noqa: ARG002
        """The part of the mid-plane's normal across the plane."""
        return np.array([[-np.sin(angle), np.cos(angle), 0.0]])

    def lay(self, m: int, chord: Chord, share: Array) -> tuple[Array, Array, Array]:  # noqa: ARG002
        """Only the end of the chord is met; its direction follows from the module.

        The end is at p = w U + s (2 u_z U - z), with w the extension and s the static length, so U points along p + s z.
        """
        static = chord.length
        p = chord.end + [0.0, 0.0, static]
        size = float(np.linalg.norm(p))
        U = p / size
        turn = np.eye(3) - 2 * np.outer(U, U)
        turn[:, 2] *= -1
        return np.array([U[0], U[1], (size - 2 * static * U[2] - self.geometry.joint_offset[m]) / 2]), turn, chord.end


def make_double_octahedra(modules: Sequence[DoubleOctahedral], side: float) -> DoubleOctahedra:
    """The set of described modules on faces of a side, m."""
    longeron, offset, reach = np.array([[m.longeron, m.joint_offset, m.straight] for m in modules]).T
    zero = np.zeros(len(modules))
    geometry = double.DoubleOctahedronGeometry(np.full(len(modules), side), longeron, offset)
    straight = np.stack([zero, zero, (reach - offset) / 2], axis=-1)
    return DoubleOctahedra(tuple(module.name for module in modules), straight, geometry)


def node_groups(module: DoubleOctahedral | GeneralDoubleOctahedral) -> tuple[str, ...]:
    """The mid-plane; with a joint offset feet, middles and heads of joint blocks."""
    return ("foot", "mid", "head") if module.joint_offset else ("mid",)


def plan_members(module: DoubleOctahedral | GeneralDoubleOctahedral, groups: Groups) -> list[PlannedMember]:
    """Twelve longerons and three actuators round the mid-plane."""
    mid = groups["mid"]
    at = {"foot": mid, "head": mid, **groups}
    plan = [
        PlannedMember("longeron", module.longeron_tube, at[below][i], at[above][j], number)
        for number, ((below, i), (above, j)) in enumerate(_LONGERONS, 1)
    ]
    plan += [PlannedMember("actuator", module.cylinder, mid[i], mid[j], n) for n, (i, j) in enumerate(TRIANGLE, 1)]
    return plan


KIND = Kind(plan=plan_members, groups=node_groups, make_set=make_double_octahedra)
