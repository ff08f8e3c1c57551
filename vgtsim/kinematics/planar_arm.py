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
from numpy.typing import NDArray

from vgtsim.errors import DescriptionError
from vgtsim.kinematics.bending import bend_all, can_swing
from vgtsim.kinematics.chain import Chain

Array = NDArray[np.float64]

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
        """Refuse an arm that does not stay in a plane.

        Raises:
            DescriptionError: It has hinges, static longerons or sections that are not straight.
        """
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
            for m, a in enumerate(place.active):
                q[:, place.columns[m]] = place.modules.extend(m, q[:, place.columns[m]], extension[:, a])
        return q

    def input_slopes(self, bend: Array, extension: Array) -> Array:
        """Derivatives of the inputs by the shape parameters, shape (W, n, 2 A), by differences."""
        count, owner = bend.shape[1], self.chain.layout.owner
        slopes = np.zeros((len(bend), len(owner), 2 * count))
        by_bend = (self.inputs(bend + _STEP, extension) - self.inputs(bend - _STEP, extension)) / (2 * _STEP)
        by_reach = (self.inputs(bend, extension + _STEP) - self.inputs(bend, extension - _STEP)) / (2 * _STEP)
        each = np.arange(len(owner))
        slopes[:, each, owner], slopes[:, each, count + owner] = by_bend, by_reach
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
        heading = np.zeros(rows)
        for a in range(count):
            halfway, heading = heading + bend[:, a] / 2, heading + bend[:, a]
            for k, turn, size in ((2 * a + 2, halfway, extension[:, a]), (2 * a + 3, heading, beyond[a])):
                along, across = (np.sin(turn), -np.cos(turn)), (np.cos(turn), np.sin(turn))
                points[:, k] = points[:, k - 1] + (np.multiply(size, along)).T
                if slopes:
                    J[:, k] = J[:, k - 1]
                    J[:, k, :, :a] += np.multiply(size, across).T[..., None]
                    J[:, k, :, a] += (0.5 if k == 2 * a + 2 else 1.0) * np.multiply(size, across).T
                    if k == 2 * a + 2:
                        J[:, k, :, count + a] += np.stack(along, axis=-1)
        return points, J

    def place(self, points: Array) -> Array:
        """Points of frame G, shape (..., 3), for points (r, z) of the plane, shape (..., 2)."""
        mount = self.chain.mount
        level = np.array([np.cos(self.azimuth), np.sin(self.azimuth), 0.0])
        foot = mount[:3, 3] * [1.0, 1.0, 0.0]
        return foot + points[..., :1] * (mount[:3, :3] @ level) + points[..., 1:] * np.array([0.0, 0.0, 1.0])


def _steps(chain: Chain) -> Array:
    """Displacements of the static sections before the first active module and after each, shape (A + 1, 3), m."""
    return np.concatenate([chain.layout.root[None, :3, 3], chain.layout.after[:, :3, 3]])


def axis_of(chain: Chain, nodes: Array) -> Array:
    """The arm's axis from its nodes, shape (..., N, 3), m: the centroids of mast flange and of every module's top, in frame G.

    They have shape (..., K + 1, 3).
    """
    truss = chain.truss
    tops = [np.flatnonzero(truss.node_module == k)[-3:] for k in range(len(chain.manipulator.modules))]
    groups = [np.arange(3), *tops]
    return np.stack([nodes[..., group, :].mean(axis=-2) for group in groups], axis=-2)
