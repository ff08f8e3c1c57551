"""The symmetric batten-actuated double octahedron (sections 3.5.3 and 3.5.4) as a kind of module, see `sets`.

Inputs are mid-planes (u_x, u_y, d), see `mid_plane`; legs are the three actuators.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.modules import DoubleOctahedral, GeneralDoubleOctahedral
from vgtsim.errors import AssemblyError, SingularityError
from vgtsim.kinematics.mode_following import follow, worst_direction
from vgtsim.kinematics.modules import mid_plane as double
from vgtsim.kinematics.modules.kind import TRIANGLE, Groups, Kind, PlannedMember
from vgtsim.kinematics.modules.sets import Chord, Mask, ModuleSet, ModuleState, all_legs, find_short
from vgtsim.kinematics.modules.stroke_proof import prove_strokes

Array = NDArray[np.float64]

# given as the fraction covered when lengths were reached with the mid-plane turned over, or past a mid node's circle
_TURNED = 0.999
_FLAT = 1 - 1e-12  # u_x² + u_y² of the normal from which u_z, by which is divided, is no number to rely on
_LOW = 0.98  # the same from which a mid-plane counts as lying flat: the inputs change their meaning at one
_TOUCHING = 1e-12  # least square of the sine at a circle, where a plane only touches it and rates grow without bound

_MIRROR = np.diag([1.0, 1.0, -1.0])  # the top is the base seen in the mid-plane: Z of T points away from the module
_TWICE = np.array([2.0, 2.0, -2.0])  # the diagonal of the mirror, doubled

# ends as (base | foot | head | top, corner); L1 to L12 of figure 3.10; without a joint offset foot and head are one
_LONGERONS = (
    *((("base", i), ("foot", j)) for i, j in ((0, 0), (1, 1), (2, 2), (2, 0), (0, 1), (1, 2))),
    *((("head", i), ("top", j)) for i, j in ((1, 0), (2, 1), (0, 2), (0, 0), (1, 1), (2, 2))),
)


@dataclass(frozen=True, eq=False)
class MidPlanes(ModuleState):
    """Kinematics of double octahedra, without trigonometry: rates of positioning depend on its speed."""

    modules: DoubleOctahedra

    @cached_property
    def _leaning(self) -> Array:
        a, b = self.x[..., 0], self.x[..., 1]
        return a * a + b * b

    @cached_property
    def placed(self) -> Mask:
        """Normals that do not lie in the base plane."""
        return (self._leaning < _FLAT) & np.isfinite(self.x[..., 2])

    @cached_property
    def _sound(self) -> tuple[Array, Array]:
        """Inputs, straight ones where they mean nothing, and normals U, each shape (b, M, 3)."""
        placed = self.placed
        if placed.all():
            g, leaning = self.x, self._leaning
        else:
            g = np.where(placed[..., None], self.x, self.modules.straight)
            leaning = np.where(placed, self._leaning, 0.0)
        U = np.empty(g.shape)
        U[..., :2] = g[..., :2]
        U[..., 2] = np.sqrt(1 - leaning)
        return g, U

    @cached_property
    def transform(self) -> tuple[Array, Array]:
        """R_BT = (I - 2 U Uᵀ) diag(1, 1, -1) and P_BT = (2 d + Ljo) U: equations 3.52 to 3.54 in closed form."""
        g, U = self._sound
        turn = _MIRROR - (U[..., None] * (U * _TWICE)[..., None, :])
        return turn, (2 * g[..., 2] + self.modules.geometry.joint_offset)[..., None] * U

    @cached_property
    def twist(self) -> tuple[Array, Array]:
        """[omega]x = dR Rᵀ with omega = 2 U x dU."""
        g, U = self._sound
        a, b, c = U[..., 0], U[..., 1], U[..., 2]
        way, twice = 2 * g[..., 2] + self.modules.geometry.joint_offset, 2 * U
        p, q = a / c, b / c  # -dU_z by u_x and u_y
        across = twice[..., 0] * q
        spin, slide = np.zeros((2, *g.shape, 3))
        spin[..., 0, 0] = -across
        spin[..., 0, 1] = 2 * (c + a * p)
        spin[..., 0, 2] = -twice[..., 1]
        spin[..., 1, 0] = -2 * (b * q + c)
        spin[..., 1, 1] = across
        spin[..., 1, 2] = twice[..., 0]
        slide[..., 0, 0] = slide[..., 1, 1] = way
        slide[..., 0, 2], slide[..., 1, 2] = -way * p, -way * q
        slide[..., 2, :] = twice
        return spin, slide

    @cached_property
    def _meeting(self) -> tuple[Array, Array, Array, Mask]:
        """Where a mid-plane meets the circles of n4 to n6 (3.28).

        Returns U·v, the cosine of the angle between normal and radius, the normal's size in the circles' planes, each
        shape (b, M, 3), and whether it meets all three.
        """
        g, U = self._sound
        geometry = self.modules.geometry
        lean = U @ double.INWARD.T
        size = np.sqrt(lean * lean + U[..., 2:] * U[..., 2:])
        cosine = (g[..., 2:] + geometry.apothem[:, None] * lean) / (geometry.height[:, None] * size)
        return lean, cosine, size, np.all(np.abs(cosine) < 1, axis=-1)

    @cached_property
    def _phi(self) -> tuple[Array, Array]:
        """Cosine and sine of the angles phi of equation 3.28, each shape (b, M, 3)."""
        z = self._sound[1][..., 2:]
        lean, cosine, size, _ = self._meeting
        sine = np.sqrt(np.maximum(1 - cosine * cosine, _TOUCHING))
        # that of the normal plus that between normal and radius: the outward branch
        return (lean * cosine - z * sine) / size, (z * cosine + lean * sine) / size

    @cached_property
    def _feet(self) -> Array:
        """n4 to n6, shape (b, M, 3, 3)."""
        cos, sin = self._phi
        geometry = self.modules.geometry
        h = geometry.height[:, None]
        nodes = (h * cos - geometry.apothem[:, None])[..., None] * double.INWARD
        nodes[..., 2] = h * sin
        return nodes

    @cached_property
    def _slopes(self) -> tuple[Array, Array]:
        """Tangents of n4 to n6, and the rates of their angles by the inputs, each shape (b, M, 3, 3)."""
        U, nodes, (cos, sin), lean = self._sound[1], self._feet, self._phi, self._meeting[0]
        h, z = self.modules.geometry.height[:, None], U[..., 2:]
        tangent = (-h * sin)[..., None] * double.INWARD
        tangent[..., 2] = h * cos
        # h (U·v cos phi + u_z sin phi) = d - U·c, differentiated implicitly
        rate = np.empty(nodes.shape)
        rate[..., 0] = -(nodes[..., 0] - nodes[..., 2] * U[..., :1] / z)
        rate[..., 1] = -(nodes[..., 1] - nodes[..., 2] * U[..., 1:2] / z)
        rate[..., 2] = 1.0
        rate /= (h * (cos * z - sin * lean))[..., None]
        return tangent, rate

    @cached_property
    def closed(self) -> Mask:
        """Mid-planes that meet all three longeron circles."""
        return self.placed & self._meeting[3]

    @cached_property
    def valid(self) -> Mask:
        """Those that do not lie nearly flat."""
        return self.closed & (self._leaning < _LOW)

    @cached_property
    def legs(self) -> tuple[Array, Array]:
        """Distances n4 n5, n5 n6, n6 n4."""
        nodes, (tangent, rate) = self._feet, self._slopes
        ahead = [1, 2, 0]
        span = nodes[..., ahead, :] - nodes
        length = np.sqrt(np.sum(span * span, axis=-1))
        span /= length[..., None]
        far = np.sum(span * tangent[..., ahead, :], axis=-1)[..., None] * rate[..., ahead, :]
        return length, far - np.sum(span * tangent, axis=-1)[..., None] * rate

    @cached_property
    def inner(self) -> Array:
        """Mid nodes n4, n5, n6; with a joint offset the blocks' feet n4 to n6, middles, and heads n4' to n6'."""
        feet = self._feet
        if not self.modules.offset:
            return feet
        rise = self.modules.geometry.joint_offset[:, None, None] * self._sound[1][..., None, :]
        return np.concatenate([feet, feet + rise / 2, feet + rise], axis=-2)

    @cached_property
    def inner_slope(self) -> Array:
        """The feet slide along their tangents; heads and middles turn with the normal."""
        tangent, rate = self._slopes
        feet = tangent[..., None] * rate[..., None, :]
        if not self.modules.offset:
            return feet
        U, rise = self._sound[1], np.zeros((*self.x.shape[:-1], 1, 3, 3))
        rise[..., 0, 0, 0] = rise[..., 0, 1, 1] = 1.0
        rise[..., 0, 2, :2] = -U[..., :2] / U[..., 2:]
        rise *= self.modules.geometry.joint_offset[:, None, None, None]
        return np.concatenate([feet, feet + rise / 2, feet + rise], axis=-3)


@dataclass(frozen=True, eq=False)
class DoubleOctahedra(ModuleSet):
    """Symmetric double octahedra.

    Attributes:
        geometry: With figures of shape (M,); all of them or none have a joint offset.
    """

    geometry: double.DoubleOctahedronGeometry
    inputs = 3
    units = ("dimensionless", "dimensionless", "m")
    leans = stows = True

    @cached_property
    def offset(self) -> bool:
        """Whether the modules have joint blocks."""
        return bool(np.any(self.geometry.joint_offset > 0))

    @cached_property
    def inner_count(self) -> int:
        """Three mid nodes; with a joint offset the feet, middles and heads of three joint blocks."""
        return 9 if self.offset else 3

    @cached_property
    def actuated(self) -> Mask:
        """All of them."""
        return all_legs(self.names, 3)

    def at(self, x: Array) -> MidPlanes:
        """As `MidPlanes`."""
        return MidPlanes(x, self)

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
        """Angles phi of the mid nodes, shape (..., M, 3), rad.

        Raises:
            AssemblyError: A mid-plane misses a longeron circle; the module is named.
        """
        if np.any(double.find_misses(self.geometry, x) > 0):
            raise self.refuse(x)
        return double.angles(self.geometry, x)

    def one(self, m: int) -> DoubleOctahedra:
        """The set of module m alone."""
        return DoubleOctahedra(self.names[m : m + 1], self.straight[m : m + 1], self.geometry.one(m))

    def dimensions(self, m: int) -> object:
        """Face side, longeron and offset."""
        own = self.geometry.one(m)
        return (*own.face_side, *own.longeron, *own.joint_offset)

    def attempt(self, lengths: Array, start: Array | None = None) -> tuple[Array, Array]:
        """Conventional forward solution of lengths, shape (..., M, 3), m; each step is proved to stay on the mode of the start.

        The start has shape (..., M, 3); absent for the straight modules with three equal actuators of the mean length.
        Returns mid-planes, shape (..., M, 3), and the fraction of the way covered, shape (..., M).
        """
        phi, reached = self._follow(lengths, start)
        x = double.midplane_from_angles(self.geometry, phi)
        outward = np.sum(double.tangents(self.geometry, phi) * double.normal(x)[..., None, :], axis=-1) < 0
        sound = np.all(outward, axis=-1) & double.upright(self.geometry, phi)
        return x, np.where(sound, reached, np.minimum(reached, _TURNED))

    def _follow(self, lengths: Array, start: Array | None) -> tuple[Array, Array]:
        """Angles, shape (..., M, 3), rad, and the fraction of the way covered, shape (..., M)."""
        begin = double.straight_angles(self.geometry, lengths) if start is None else self.angles(start)
        begin = np.broadcast_to(begin, lengths.shape)
        first = double.actuator_lengths(double.mid_nodes(self.geometry, begin))
        C = double.cell_closure(self.geometry, first).reshape(5, 3, -1)
        change = (first**2 - lengths**2).reshape(-1, 3).T

        def path(t: Array, index: NDArray[np.intp]) -> Array:
            now = C[..., index]
            now[0] += t * change[:, index]
            return now

        result = follow(path, begin.reshape(-1, 3))
        return result.phi.reshape(lengths.shape), result.reached.reshape(lengths.shape[:-1])

    def solve(self, lengths: Array, start: Array | None = None) -> Array:
        """As `attempt`, but all lengths must be reached.

        Raises:
            AssemblyError: Three actuators do not make a triangle; the module is named.
            SingularityError: A singularity lies between.
        """
        excess = 2 * np.max(lengths, axis=-1) - np.sum(lengths, axis=-1)
        if np.any(~(excess < 0)):
            worst = np.unravel_index(int(np.argmax(excess)), excess.shape)
            detail = f"actuators of {np.array2string(lengths[worst], precision=4)} m make no triangle"
            raise AssemblyError(self.names[worst[-1]], float(excess[worst]), detail)
        x, reached = self.attempt(lengths, start)
        worst = find_short(reached)
        if worst is not None:
            geometry, name = self.geometry.one(worst[-1]), self.names[worst[-1]]
            phi = self._follow(lengths, start)[0][worst][None]
            value, row = worst_direction(double.angle_jacobian(geometry, phi)[0] / geometry.height[0])
            gap = np.abs(double.actuator_lengths(double.mid_nodes(geometry, phi)) - lengths[worst]).max()
            raise SingularityError(name, value, f"{name}/actuator/{row + 1}", float(gap), float(reached[worst]))
        return x

    def conditioned(self, x: Array) -> Array:
        """dl/dphi over the altitude of the longeron triangles."""
        phi = self.angles(x)
        return double.angle_jacobian(self.geometry, phi) / self.geometry.height[..., None, None]

    def check_strokes(self, low: Array, high: Array) -> None:
        """By proof, see `prove_strokes`."""
        prove_strokes(self, low, high)

    def stow(self, length: float) -> Array:
        """All actuators retracted to the length."""
        return self.solve(np.full(self.actuated.shape, length))

    @cached_property
    def swings(self) -> bool:
        """A mid-plane's normal turns about Z."""
        return True

    def swing(self, x: Array, turn: Array) -> Array:
        """The normal turns, and the distance stays."""
        turned = (turn[..., :2, :2] @ x[..., :2, None])[..., 0]
        return np.concatenate([turned, np.broadcast_to(x[..., 2:], (*turned.shape[:-1], 1))], axis=-1)

    def bend(self, angle: Array, half: Array) -> Array:
        """The normal midway between the faces is the mid-plane's."""
        return np.concatenate([half[..., :2], np.broadcast_to(self.straight[:, 2:], (*angle.shape, 1))], axis=-1)

    def extend(self, m: int, x: Array, extension: float) -> Array:
        """The mid-plane stands halfway, the joint offset left out."""
        return np.array([x[0], x[1], (extension - self.geometry.joint_offset[m]) / 2])

    def sideways(self, m: int, angle: float) -> Array:  # noqa: ARG002
        """The part of the mid-plane's normal across the plane."""
        return np.array([[-np.sin(angle), np.cos(angle), 0.0]])

    def lies(self, m: int) -> bool:  # noqa: ARG002
        """A mid-plane puts the end of what follows it at any point."""
        return True

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
