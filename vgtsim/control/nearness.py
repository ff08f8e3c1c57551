"""What the arm comes near to: how fast the gaps may close in the coming step."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.compilation import compiled
from vgtsim.control.arm_now import ArmNow
from vgtsim.control.limits import allow
from vgtsim.geometry.gaps import BED, PILLAR, TANK, WASTE
from vgtsim.positioning import NearPairs
from vgtsim.site import Site

Array = NDArray[np.float64]

_REACH = 0.5  # m beyond the clearance in which gaps are looked at: an arm at 0.3 m/s stops within it
_BRAKE = 0.05  # m/s², with which the closing of a gap is slowed: half of what a tool's target may have
_SHARE = 0.3  # part of what all cylinders together could slow a gap with: they have a task beside
_MOST = 40  # gaps that are limited, the nearest: the others are farther by far
_CREEP = (
    0.02  # m/s, at which a gap may close whose bodies may touch: the tool at this speed gives a servo 0.4 mm a step
)
_SAG_EVERY = 25  # cycles between looks at how far an arm that gives sags


@compiled
def _fill_closing(gap: Array, gradient: Array, most: Array, clearance: float, timestep: float, least: Array) -> None:
    """See `GapWatch.bound`."""
    for r in range(len(gap)):
        brake = 0.0
        for j in range(len(most)):
            brake += abs(gradient[r, j]) * most[j]
        least[r] = -max(allow(gap[r] - clearance, min(_BRAKE, _SHARE * brake), timestep), 0.0)


@dataclass
class GapWatch:
    """Watches the gaps between the arm and tank, equipment, waste, mast and itself.

    Bodies that may touch, by the scene's `contacts`, come together slowly. `clearance` is the distance kept from all others, m:
    the scene's, and of an arm that gives the greatest sag of a node more.
    """

    site: Site
    clearance: float = field(init=False)
    _pairs: NearPairs = field(init=False)
    _picked: NDArray[np.intp] = field(init=False)
    _cycle: int = 0

    def __post_init__(self) -> None:
        """Begin with the scene's clearance."""
        self.clearance = self.site.clearance

    def bound(self, arm: ArmNow, most: Array, timestep: float) -> tuple[Array, Array]:
        """Derivatives of the nearest gaps by the lengths, shape (R, J), and their least rates, shape (R,), m/s.

        Greatest accelerations of the cylinders have shape (J,), m/s²: what they cannot slow down is slowed earlier.
        """
        site = self.site
        if site.sags and self._cycle % _SAG_EVERY == 0:
            nodes = arm.state.nodes[0]
            moved = site.surroundings.points(arm.q[None])[0, :-1] - nodes
            self.clearance = site.clearance + float(np.linalg.norm(moved, axis=1).max())
        self._cycle += 1
        pairs = site.surroundings.unloaded.rows(arm.state, self.clearance + _REACH)
        self._pairs, self._picked = pairs, np.argsort(pairs.gap, kind="stable")[:_MOST]
        gap, gradient = pairs.gap[self._picked], pairs.gradient[self._picked] @ arm.inputs_by_length
        least = np.empty(len(gap))
        _fill_closing(gap, gradient, most, self.clearance, timestep, least)
        if self._allowed:
            may = [self._may_touch(*bodies) for bodies in pairs.bodies[self._picked].tolist()]
            least[may] = np.minimum(least[may], -_CREEP)
        return gradient, least

    @cached_property
    def _allowed(self) -> frozenset[tuple[str, str]]:
        """Kinds of parts and places that may touch, see `AllowedContact`; none where drives cannot yield."""
        rules = self.site.task.contacts if self.site.yields else ()
        return frozenset((rule.part, rule.place) for rule in rules)

    def _may_touch(self, kind: int, first: int, second: int) -> bool:
        """Whether two near bodies, see `NearPairs.bodies`, may touch."""
        around, truss = self.site.surroundings, self.site.truss
        if kind in (TANK, WASTE):  # balls about nodes, and the payload
            part, place = "tool" if first >= truss.tip.start else "hubs", "shell" if kind == TANK else "waste"
            return (part, place) in self._allowed
        part = "members" if first < len(truss.members) else "tool"
        if kind == BED:
            return (part, "waste") in self._allowed
        names = around.obstacles.names
        return kind == PILLAR and second < len(names) and (part, names[second]) in self._allowed

    def name(self, row: int) -> str:
        """Names of the two bodies of a row of `bound`."""
        return self.site.surroundings.name_pair(self._pairs.bodies[self._picked[row]])

    @property
    def nearest(self) -> tuple[float, str]:
        """Least gap, m, and its bodies; infinite where nothing is within reach."""
        return (float(self._pairs.gap[self._picked[0]]), self.name(0)) if len(self._picked) else (np.inf, "")
