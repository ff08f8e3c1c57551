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

from vgtsim.arrays import Array, Mask
from vgtsim.description import GeneralDoubleOctahedral
from vgtsim.errors import AssemblyError, SingularityError
from vgtsim.kinematics.closure import edge_lengths
from vgtsim.kinematics.modules import two_cells as cells
from vgtsim.kinematics.modules.double_octahedral import node_groups, plan_members
from vgtsim.kinematics.modules.sets import Kind, ModuleSet, naming
from vgtsim.kinematics.modules.stroke_boxes import search_strokes


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
    def figures(self) -> Array:
        """Sign of the determinant of the legs' derivatives in the straight pose, shape (M, 1)."""
        return np.sign(np.linalg.det(self.angle_jacobian(self.straight)))[:, None]

    def fill(
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
                J = np.swapaxes(cells.jacobian(geometry, states), -1, -2)
                motion[:, m, :, :3], motion[:, m, :, 3:] = J[..., 3:], J[..., :3]
            if length.size:  # the lower cell alone, in closed form
                length[:, m], slope[:, m] = cells.actuator_lengths(geometry, phi), cells.angle_jacobian(geometry, phi)
                marks[:, m, 2] = sound  # lengths depend on the lower cell alone
                marks[:, m, 3] = good & (np.linalg.det(slope[:, m]) * figures[m, 0] > 0)
            if inner.size:
                inner[:, m] = self._with_blocks(nodes[:, :3], nodes[:, 3:6])
            if inner_slope.size:
                both = cells.mid_velocities(geometry, states)
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

    def dimensions(self, m: int) -> object:
        """As `TwoCellGeometry`, and the straight pose."""
        return (self.geometries[m], *self.begins[m])

    def states(self, x: Array) -> Array:
        """All six angles, (..., M, 6), rad; an AssemblyError names a module that is not assembled short of a singularity."""
        states = np.empty((*x.shape[:-1], 6))
        for m, (name, geometry) in enumerate(zip(self.names, self.geometries, strict=True)):
            with naming(name):
                states[..., m, :] = cells.forward(geometry, x[..., m, :], self.begins[m])
        return states

    def attempt(self, lengths: Array, start: Array | None = None) -> tuple[Array, Array]:
        """As `two_cells.advance_lengths`, of lengths (..., M, 3), m: inputs, (..., M, 3), and fraction of the way, (..., M)."""
        x, reached = np.empty(lengths.shape), np.empty(lengths.shape[:-1])
        begin = self.begins if start is None else self.states(start)
        for m, geometry in enumerate(self.geometries):
            state, part = cells.advance_lengths(geometry, lengths[..., m, :], begin[..., m, :])
            x[..., m, :], reached[..., m] = state[..., :3], part
        return x, reached

    def require_closing(self, lengths: Array) -> None:
        """Refuse actuators that make no triangle, or over which two longerons do not meet."""
        for m, (name, geometry) in enumerate(zip(self.names, self.geometries, strict=True)):
            with naming(name):
                cells.upper_circles(geometry, lengths[..., m, :])

    def tell_end(self, lengths: Array, start: Array | None, part: float) -> SingularityError:
        """A singularity of either cell."""
        geometry, name = self.geometries[0], self.names[0]
        begin = self.begins if start is None else self.states(start)
        state = cells.advance_lengths(geometry, lengths[0], begin[0])[0]
        value, member = cells.singularity(geometry, state)
        sides = edge_lengths(cells.nodes(geometry, state)[6:])
        gap = np.abs([*(cells.actuator_lengths(geometry, state) - lengths[0]), *(sides - geometry.top)]).max()
        kind, number = member.split()
        return SingularityError(name, value, f"{name}/{kind}/{number[1:]}", float(gap), part)

    def conditioned(self, x: Array) -> Array:
        """dl/dphi over the mean radius of the circles."""
        radius = np.array([np.mean(geometry.circles.radius) for geometry in self.geometries])
        return self.angle_jacobian(x) / radius[:, None, None]

    def find_least(self, x: Array) -> Array:
        """That of the nearer cell, as `two_cells.singularity`."""
        lower = np.linalg.svd(self.conditioned(x), compute_uv=False)[..., -1]
        states, upper = self.states(x), []
        for m, geometry in enumerate(self.geometries):
            J = cells.upper_jacobian(cells.nodes(geometry, states[..., m, :]))
            upper.append(np.linalg.svd(J / geometry.twist_units, compute_uv=False)[..., -1])
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
        with naming(module.name):
            begins.append(cells.forward_lengths(geometries[-1], [module.straight] * 3))
    return GeneralDoubleOctahedra(names, np.array(begins)[:, :3], tuple(geometries), np.array(begins))


KIND = Kind(plan=plan_members, groups=node_groups, make_set=make_general_double_octahedra)
