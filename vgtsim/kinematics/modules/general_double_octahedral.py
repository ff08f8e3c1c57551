"""The general batten-actuated double octahedron (sections 3.5.1 and 3.5.2) as a kind of module, see `sets`.

Inputs are the angles phi_1 to phi_3 of 3.28, legs the three actuators. The upper cell follows from the lower by its
closure, on the assembly mode of the straight pose: every call comes from there, so that what an input means depends on
nothing else. Such a module has kinematics, statics and a MuJoCo model; it bends in no plane by its inputs, so an arm that
has one is not positioned.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.modules import GeneralDoubleOctahedral
from vgtsim.errors import AssemblyError, SingularityError
from vgtsim.kinematics.modules import two_cell_rates as rates
from vgtsim.kinematics.modules import two_cells as cells
from vgtsim.kinematics.modules.double_octahedral import node_groups, plan_members
from vgtsim.kinematics.modules.kind import Kind
from vgtsim.kinematics.modules.sets import Mask, ModuleSet, ModuleState, all_legs
from vgtsim.kinematics.modules.stroke_search import search_strokes

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CellStates(ModuleState):
    """Kinematics of general double octahedra."""

    modules: GeneralDoubleOctahedra

    @cached_property
    def _followed(self) -> tuple[Array, Mask]:
        """All six angles, shape (b, M, 6), rad, and whether the upper cell followed all the way, shape (b, M)."""
        states, arrived = [], []
        for m, geometry in enumerate(self.modules.geometries):
            begin = self.modules.begins[m]
            phi = self.x[:, m]
            sound = np.all(np.isfinite(phi), axis=-1)
            phi = np.where(sound[:, None], phi, begin[:3])
            state, reached = cells.advance(geometry, np.broadcast_to(begin, (len(phi), 6)), phi)
            good = sound & (reached == 1.0)
            states.append(np.where(good[:, None], state, begin))
            arrived.append(good)
        return np.stack(states, axis=-2), np.stack(arrived, axis=-1)

    @cached_property
    def states(self) -> Array:
        """All six angles, shape (b, M, 6), rad; of the straight pose where the upper cell does not follow."""
        return self._followed[0]

    @cached_property
    def placed(self) -> Mask:
        """Modules whose upper cell assembles, with no singularity on the way."""
        return self._followed[1]

    @cached_property
    def kept(self) -> Mask:
        """Angles that are numbers: lengths depend on the lower cell alone."""
        return np.all(np.isfinite(self.x), axis=-1)

    @cached_property
    def valid(self) -> Mask:
        """Modules that assemble with the lower cell short of its singularity."""
        return self.placed & (np.linalg.det(self.legs[1]) * self.modules.sign > 0)

    def _each(self, solved: Callable[[cells.TwoCellGeometry, Array], Array], axis: int) -> Array:
        """A function of every module's state, stacked along the axis of the modules."""
        states = self.states
        parts = [solved(geometry, states[..., m, :]) for m, geometry in enumerate(self.modules.geometries)]
        return np.stack(parts, axis=axis)

    @cached_property
    def _nodes(self) -> Array:
        """n4 to n6, n4' to n6', n7 to n9, shape (b, M, 9, 3), m."""
        return self._each(cells.nodes, axis=-3)

    @cached_property
    def transform(self) -> tuple[Array, Array]:
        """As `two_cells.transform`."""
        return cells.triangle_frame(self._nodes[..., 6:, :])

    @cached_property
    def twist(self) -> tuple[Array, Array]:
        """As `two_cell_rates.jacobian`."""
        J = np.swapaxes(self._each(rates.jacobian, axis=-3), -1, -2)
        return J[..., 3:], J[..., :3]

    @cached_property
    def legs(self) -> tuple[Array, Array]:
        """Actuator lengths and their derivatives: the lower cell alone, in closed form."""
        x = np.where(self.kept[..., None], self.x, self.modules.straight)
        geometries = self.modules.geometries
        lengths = [cells.actuator_lengths(geometry, x[..., m, :]) for m, geometry in enumerate(geometries)]
        return np.stack(lengths, axis=-2), self.modules.angle_jacobian(x)

    @cached_property
    def inner(self) -> Array:
        """n4, n5, n6; with a joint offset the blocks' feet n4 to n6, middles, and heads n4' to n6'."""
        return self._with_blocks(self._nodes[..., :3, :], self._nodes[..., 3:6, :], -2)

    @cached_property
    def inner_slope(self) -> Array:
        """As `two_cell_rates.mid_velocities`, for all inner nodes."""
        both = self._each(rates.mid_velocities, axis=-4)
        return self._with_blocks(both[..., :3, :, :], both[..., 3:, :, :], -3)

    def _with_blocks(self, feet: Array, heads: Array, axis: int) -> Array:
        return np.concatenate([feet, (feet + heads) / 2, heads], axis=axis) if self.modules.inner_count == 9 else feet


@dataclass(frozen=True, eq=False)
class GeneralDoubleOctahedra(ModuleSet):
    """General double octahedra.

    Attributes:
        geometries: One each; all of them or none have a joint offset.
        begins: State of each straight pose, shape (M, 6), rad.
    """

    geometries: tuple[cells.TwoCellGeometry, ...]
    begins: Array
    inputs = 3
    units = ("rad", "rad", "rad")
    positionable = False  # its upper cell is followed from the straight pose, which is too slow for trial steps

    @cached_property
    def inner_count(self) -> int:
        """Three mid nodes; with a joint offset the feet, middles and heads of three joint blocks."""
        return 9 if self.geometries[0].joint_offset else 3

    @cached_property
    def actuated(self) -> Mask:
        """All of them."""
        return all_legs(self.names, 3)

    @cached_property
    def sign(self) -> Array:
        """Sign of the determinant of the legs' derivatives in the straight pose, shape (M,)."""
        return np.sign(np.linalg.det(self.angle_jacobian(self.straight)))

    def at(self, x: Array) -> CellStates:
        """As `CellStates`."""
        return CellStates(x, self)

    def refuse(self, x: Array) -> Exception:
        """A module does not assemble, or only beyond a singularity."""
        for m, (name, geometry) in enumerate(zip(self.names, self.geometries, strict=True)):
            try:
                cells.forward(geometry, x[..., m, :], self.begins[m])
            except AssemblyError as error:
                return AssemblyError(name, error.residual, str(error))
        return ValueError(f"an angle of {', '.join(self.names)} is no number")

    def angle_jacobian(self, x: Array) -> Array:
        """As `two_cells.angle_jacobian`, shape (..., M, 3, 3), m/rad."""
        parts = [cells.angle_jacobian(geometry, x[..., m, :]) for m, geometry in enumerate(self.geometries)]
        return np.stack(parts, axis=-3)

    def one(self, m: int) -> GeneralDoubleOctahedra:
        """The set of module m alone."""
        mine = slice(m, m + 1)
        return GeneralDoubleOctahedra(self.names[mine], self.straight[mine], self.geometries[mine], self.begins[mine])

    def dimensions(self, m: int) -> object:
        """As `TwoCellGeometry`, and the straight pose."""
        return (self.geometries[m], *self.begins[m])

    def _states(self, x: Array) -> Array:
        """All six angles of modules that assemble, shape (..., M, 6), rad.

        Raises:
            AssemblyError: A module does not assemble, or only beyond a singularity; it is named.
        """
        rows = self.at(x.reshape(-1, *x.shape[-2:]))
        if not rows.placed.all():
            raise self.refuse(x)
        return rows.states.reshape(*x.shape[:-1], 6)

    def attempt(self, lengths: Array, start: Array | None = None) -> tuple[Array, Array]:
        """As `two_cells.advance_lengths`: inputs, shape (..., M, 3), and the fraction of the way covered, shape (..., M).

        Lengths have shape (..., M, 3), m; starts are inputs, absent for the straight poses.
        """
        x, reached = np.empty(lengths.shape), np.empty(lengths.shape[:-1])
        begin = self.begins if start is None else self._states(start)
        for m, geometry in enumerate(self.geometries):
            state, part = cells.advance_lengths(geometry, lengths[..., m, :], begin[..., m, :])
            x[..., m, :], reached[..., m] = state[..., :3], part
        return x, reached

    def solve(self, lengths: Array, start: Array | None = None) -> Array:
        """As `attempt`, but all lengths must be reached.

        Raises:
            AssemblyError: Lengths that no pose can have; the module is named.
            SingularityError: A singularity of either cell lies between.
        """
        for m, (name, geometry) in enumerate(zip(self.names, self.geometries, strict=True)):
            try:
                cells.upper_circles(geometry, lengths[..., m, :])
            except AssemblyError as error:
                raise AssemblyError(name, error.residual, str(error)) from None
        x, reached = self.attempt(lengths, start)
        if reached.min(initial=1.0) < 1.0:
            worst = np.unravel_index(int(np.argmin(reached)), reached.shape)
            m = int(worst[-1])
            geometry, name = self.geometries[m], self.names[m]
            begin = np.broadcast_to(
                self.begins[m] if start is None else self._states(start)[..., m, :], (*x.shape[:-2], 6)
            )
            state = cells.advance_lengths(geometry, lengths[worst], begin[worst[:-1]])[0]
            value, member = rates.singularity(geometry, state)
            top = cells.nodes(geometry, state)[6:]
            sides = np.linalg.norm(top[[1, 2, 0]] - top, axis=-1)
            gap = np.abs([*(cells.actuator_lengths(geometry, state) - lengths[worst]), *(sides - geometry.top)]).max()
            kind, number = member.split()
            raise SingularityError(name, value, f"{name}/{kind}/{number[1:]}", float(gap), float(reached[worst]))
        return x

    def conditioned(self, x: Array) -> Array:
        """dl/dphi over the mean radius of the circles."""
        radius = np.array([np.mean(geometry.circles.radius) for geometry in self.geometries])
        return self.angle_jacobian(x) / radius[:, None, None]

    def find_least(self, x: Array) -> Array:
        """That of the nearer cell, as `two_cell_rates.singularity`."""
        lower = np.linalg.svd(self.conditioned(x), compute_uv=False)[..., -1]
        states, upper = self._states(x), []
        for m, geometry in enumerate(self.geometries):
            J = rates.upper_jacobian(cells.nodes(geometry, states[..., m, :]))[1]
            J[..., 3:] /= geometry.radius
            upper.append(np.linalg.svd(J, compute_uv=False)[..., -1])
        return np.minimum(lower, np.stack(upper, axis=-1))

    def check_strokes(self, low: Array, high: Array) -> None:
        """By a search, see `search_strokes`."""
        search_strokes(self, low, high)

    def bend(self, angle: Array, half: Array) -> Array:  # noqa: ARG002
        """Every angle of its lower cell grows by the bend: no symmetric one is known in closed form."""
        return self.straight + angle[..., None]


def make_general_double_octahedra(modules: Sequence[GeneralDoubleOctahedral], side: float) -> GeneralDoubleOctahedra:
    """The set of described modules; faces that are not given are the arm's, of a side in m.

    Raises:
        AssemblyError: A module does not assemble in its straight pose, three equal actuators; it is named.
    """
    names, geometries, begins = tuple(module.name for module in modules), [], []
    for module in modules:
        base, top = module.faces(side)
        geometries.append(cells.TwoCellGeometry(base, top, module.longerons, module.joint_offset))
        try:
            begins.append(cells.forward_lengths(geometries[-1], [module.straight] * 3))
        except AssemblyError as error:
            raise AssemblyError(module.name, error.residual, str(error)) from None
    return GeneralDoubleOctahedra(names, np.array(begins)[:, :3], tuple(geometries), np.array(begins))


KIND = Kind(plan=plan_members, groups=node_groups, make_set=make_general_double_octahedra)
