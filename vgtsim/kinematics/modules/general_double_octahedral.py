"""The general batten-actuated double octahedron (sections 3.5.1 and 3.5.2) as a kind of module, see `sets`.

Inputs are the angles phi_1 to phi_3 of 3.28, legs the three actuators. The upper cell follows from the lower by its
closure, on the assembly mode of the straight pose: every call comes from there, so that what an input means depends on
nothing else. That makes a trial step far dearer than one of a symmetric module. No input bends it in a plane, so
a bend that is asked of it is a first guess.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.description import GeneralDoubleOctahedral
from vgtsim.errors import AssemblyError, SingularityError
from vgtsim.kinematics.modules import two_cell_rates as rates
from vgtsim.kinematics.modules import two_cells as cells
from vgtsim.kinematics.modules.double_octahedral import node_groups, plan_members
from vgtsim.kinematics.modules.kind import Kind
from vgtsim.kinematics.modules.sets import Fill, Mask, ModuleSet, all_legs
from vgtsim.kinematics.modules.stroke_search import search_strokes

Array = NDArray[np.float64]


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
    stows = True

    @cached_property
    def inner_count(self) -> int:
        """Three mid nodes; with a joint offset the feet, middles and heads of three joint blocks."""
        return 9 if self.geometries[0].joint_offset else 3

    @cached_property
    def actuated(self) -> Mask:
        """All of them."""
        return all_legs(self.names, 3)

    @cached_property
    def figures(self) -> Array:
        """Sign of the determinant of the legs' derivatives in the straight pose, shape (M, 1)."""
        return np.sign(np.linalg.det(self.angle_jacobian(self.straight)))[:, None]

    @cached_property
    def fill(self) -> Fill:
        """As `_fill`."""
        return self._fill

    def _fill(
        self,
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
        """See `Fill`, module by module: the upper cell is followed from the straight pose."""
        for m, geometry in enumerate(self.geometries):
            sound = np.all(np.isfinite(x[:, m]), axis=-1)
            phi = np.where(sound[:, None], x[:, m], straight[m])
            states, reached = cells.advance(geometry, np.broadcast_to(self.begins[m], (len(phi), 6)), phi)
            good = sound & (reached == 1.0)
            states = np.where(good[:, None], states, self.begins[m])
            marks[:, m, 0] = marks[:, m, 1] = good
            nodes = cells.nodes(geometry, states)
            if frame.size:
                frame[:, m, :, :3], frame[:, m, :, 3] = cells.triangle_frame(nodes[:, 6:])
            if motion.size:
                J = np.swapaxes(rates.jacobian(geometry, states), -1, -2)
                motion[:, m, :, :3], motion[:, m, :, 3:] = J[..., 3:], J[..., :3]
            if length.size:  # the lower cell alone, in closed form
                length[:, m], slope[:, m] = cells.actuator_lengths(geometry, phi), cells.angle_jacobian(geometry, phi)
                marks[:, m, 2] = sound  # lengths depend on the lower cell alone
                marks[:, m, 3] = good & (np.linalg.det(slope[:, m]) * figures[m, 0] > 0)
            if inner.size:
                inner[:, m] = self._with_blocks(nodes[:, :3], nodes[:, 3:6])
            if inner_slope.size:
                both = rates.mid_velocities(geometry, states)
                inner_slope[:, m] = self._with_blocks(both[:, :3], both[:, 3:])

    def _with_blocks(self, feet: Array, heads: Array) -> Array:
        """n4, n5, n6; with a joint offset the blocks' feet n4 to n6, middles, and heads n4' to n6'; stacked along axis 1."""
        return np.concatenate([feet, (feet + heads) / 2, heads], axis=1) if self.inner_count == 9 else feet

    def refuse(self, x: Array) -> Exception:
        """A module does not assemble, or only beyond a singularity."""
        try:
            self.states(x)
        except AssemblyError as error:
            return error
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

    def states(self, x: Array) -> Array:
        """All six angles of modules that assemble, shape (..., M, 6), rad.

        Raises:
            AssemblyError: A module does not assemble, or only beyond a singularity; it is named.
        """
        states = np.empty((*x.shape[:-1], 6))
        for m, (name, geometry) in enumerate(zip(self.names, self.geometries, strict=True)):
            try:
                states[..., m, :] = cells.forward(geometry, x[..., m, :], self.begins[m])
            except AssemblyError as error:
                raise AssemblyError(name, error.residual, str(error)) from None
        return states

    def attempt(self, lengths: Array, start: Array | None = None) -> tuple[Array, Array]:
        """As `two_cells.advance_lengths`: inputs, shape (..., M, 3), and the fraction of the way covered, shape (..., M).

        Lengths have shape (..., M, 3), m; starts are inputs, absent for the straight poses.
        """
        x, reached = np.empty(lengths.shape), np.empty(lengths.shape[:-1])
        begin = self.begins if start is None else self.states(start)
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
                self.begins[m] if start is None else self.states(start)[..., m, :], (*x.shape[:-2], 6)
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
        states, upper = self.states(x), []
        for m, geometry in enumerate(self.geometries):
            J = rates.upper_jacobian(cells.nodes(geometry, states[..., m, :]))[1]
            J[..., 3:] /= geometry.radius
            upper.append(np.linalg.svd(J, compute_uv=False)[..., -1])
        return np.minimum(lower, np.stack(upper, axis=-1))

    def check_strokes(self, low: Array, high: Array) -> None:
        """By a search, see `search_strokes`."""
        search_strokes(self, low, high)

    def stow(self, length: float) -> Array:
        """All actuators retracted to the length."""
        return self.solve(np.full(self.actuated.shape, length))

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
