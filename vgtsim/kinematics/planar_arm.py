"""An arm bent in one vertical plane: its centre line and inputs from the bend and the extension of every active module.

A module that is bent symmetrically moves the centroid of its top face by its extension, in the direction halfway between
the normals of its faces. So in its plane the centre line is a chain of straight pieces: the extension of each active module
and the length of the static sections after it. Points of the plane are (r, z): r from the mast's axis towards the azimuth,
z up, m. Headings count from straight down, positive towards +r.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array
from vgtsim.compilation import by_rows, compiled
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.bending import bend_all, can_swing
from vgtsim.kinematics.chain import Chain

_STEP = 1e-6  # rad and m: of the differences of inputs, whose formulas are smooth
_ASIDE = 1e-9  # m: rounding of a static section whose faces are above one another


@dataclass(frozen=True, eq=False)
class PlanarArm:
    """An arm in the vertical plane at an azimuth, rad, from X of B_1.

    Bends, rad, and extensions, m, of the A active modules have shape (W, A). Together they are 2 A shape parameters, bends
    first.
    """

    chain: Chain
    azimuth: float

    def __post_init__(self) -> None:
        """Refuse an arm that does not stay in a plane, with hinges, static longerons or bent sections: a DescriptionError."""
        chain = self.chain
        if not can_swing(chain) or np.any(np.abs(_steps(chain)[:, :2]) > _ASIDE):
            allowed = (
                "double octahedra, octahedra with six actuators and straight sections: they bend in any vertical plane"
            )
            raise DescriptionError(None, "modules", f"{chain.manipulator.name}, which does not", allowed)

    @cached_property
    def static(self) -> Array:
        """Lengths of the static sections before the first active module and after each, shape (A + 1,), m; no tool."""
        return _steps(self.chain)[:, 2]

    @cached_property
    def stowed(self) -> Array:
        """Extension of each active module of the stowed arm, shape (A,), m."""
        state = self.chain.state(self.chain.stowed[None])
        reach = np.empty(len(self.chain.layout.names))
        for place, part in zip(self.chain.layout.places, state.parts, strict=True):
            reach[place.active] = np.linalg.norm(part.frame[0, :, :, 3], axis=-1)
        return reach

    @cached_property
    def tops(self) -> Array:
        """Depth of the upper face of each active module of the stowed arm below the mast flange, shape (A,), m."""
        return np.cumsum(self.static[:-1]) + np.concatenate([[0.0], np.cumsum(self.stowed)[:-1]])

    @property
    def tool_offset(self) -> float:
        """Distance of the tool point beyond the last face, m."""
        return self.chain.manipulator.tip_plate.tool_offset

    @property
    def stowed_length(self) -> float:
        """Distance of the tool point from the mast flange of the stowed arm, m."""
        return float(self.static.sum() + self.stowed.sum() + self.tool_offset)

    def inputs(self, bend: Array, extension: Array) -> Array:
        """Inputs of the chain, shape (W, n)."""
        q = bend_all(self.chain, bend, self.azimuth)
        for place in self.chain.layout.places:
            q[:, place.columns] = place.modules.extend(slice(None), place.take(q), extension.take(place.active, axis=1))
        return q

    def input_slopes(self, bend: Array, extension: Array) -> Array:
        """Derivatives of the inputs by the shape parameters, shape (W, n, 2 A), by differences."""
        (rows, count), owner = bend.shape, self.chain.layout.owner
        bends = np.concatenate([bend + _STEP, bend - _STEP, bend, bend])
        reaches = np.concatenate([extension, extension, extension + _STEP, extension - _STEP])
        q = self.inputs(bends, reaches).reshape(4, rows, -1)
        slopes, each = np.zeros((rows, len(owner), 2 * count)), np.arange(len(owner))
        slopes[:, each, owner] = (q[0] - q[1]) / (2 * _STEP)
        slopes[:, each, count + owner] = (q[2] - q[3]) / (2 * _STEP)
        return slopes

    def line(self, bend: Array, extension: Array, top: Array, *, slopes: bool = False) -> tuple[Array, Array]:
        """Corners of the centre line: mast flange, both faces of every active module, tool point.

        `top` are the heights of the mast flange, shape (W,), m. Returns points (r, z), shape (W, 2 A + 2, 2), and their
        derivatives by the shape parameters, shape (W, 2 A + 2, 2, 2 A), empty unless `slopes`.
        """
        rows, count = bend.shape
        points = np.zeros((rows, 2 * count + 2, 2))
        J = np.zeros((rows, 2 * count + 2, 2, 2 * count if slopes else 0))
        points[:, 0, 1], points[:, 1, 1] = top, top - self.static[0]
        beyond = self.static[1:] + self.tool_offset * (np.arange(count) == count - 1)
        heading = np.cumsum(bend, axis=1)
        turns = np.stack([np.concatenate([np.zeros((rows, 1)), heading[:, :-1]], axis=1) + bend / 2, heading], axis=-1)
        trace(np.sin(turns), np.cos(turns), by_rows(extension), beyond, points, J)
        return points, J

    def place(self, points: Array) -> Array:
        """Points of frame G, shape (..., 3), for points (r, z) of the plane, shape (..., 2)."""
        mount = self.chain.mount
        level = np.array([np.cos(self.azimuth), np.sin(self.azimuth), 0.0])
        foot = mount[:3, 3] * [1.0, 1.0, 0.0]
        return foot + points[..., :1] * (mount[:3, :3] @ level) + points[..., 1:] * np.array([0.0, 0.0, 1.0])


@compiled
def trace(sin: Array, cos: Array, extension: Array, beyond: Array, points: Array, J: Array) -> None:
    """Write the corners of a centre line below its first two, see `PlanarArm.line`, and slopes if there is room for them.

    Sines and cosines of the headings have shape (W, A, 2): of each module halfway, and of what follows it.
    """
    rows, count = extension.shape
    for w in range(rows):
        for a in range(count):
            for part in range(2):
                k, size = 2 * a + 2 + part, beyond[a] if part else extension[w, a]
                along, across = (sin[w, a, part], -cos[w, a, part]), (cos[w, a, part], sin[w, a, part])
                for i in range(2):
                    points[w, k, i] = points[w, k - 1, i] + size * along[i]
                    if J.shape[3]:
                        J[w, k, i] = J[w, k - 1, i]
                        J[w, k, i, :a] += size * across[i]
                        J[w, k, i, a] += (1.0 if part else 0.5) * size * across[i]
                        J[w, k, i, count + a] += 0.0 if part else along[i]


def _steps(chain: Chain) -> Array:
    """Displacements of the static sections before the first active module and after each, shape (A + 1, 3), m."""
    return np.concatenate([chain.layout.root[None, :3, 3], chain.layout.after[:, :3, 3]])


def axis_of(chain: Chain, nodes: Array) -> Array:
    """The arm's axis: centroids of the flange and each module's top, (..., K + 1, 3), m, of nodes (..., N, 3), in frame G."""
    return nodes[..., chain.truss.faces, :].mean(axis=-2)
