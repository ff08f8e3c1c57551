"""What the arm comes near to, and how much of its strength it uses: how fast gaps may close and uses rise in the coming step."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.compilation import compiled
from vgtsim.control.arm_now import ArmNow
from vgtsim.control.limits import allow
from vgtsim.geometry.gaps import BED, PILLAR, TANK, WASTE
from vgtsim.positioning import NearPairs
from vgtsim.site import Site
from vgtsim.statics import find_use

_REACH = 0.5  # m beyond the clearance in which gaps are looked at: an arm at 0.3 m/s stops within it
_BRAKE = 0.05  # m/s², with which the closing of a gap is slowed: half of what a tool's target may have
_SHARE = 0.3  # part of what all cylinders together could slow a gap with: they have a task beside
_MOST = 40  # gaps that are limited, the nearest: the others are farther by far
_CREEP = (
    0.02  # m/s, at which a gap may close whose bodies may touch: at this speed the tool gives a servo 0.4 mm a step
)
_SAG_EVERY = 25  # cycles between looks at how far an arm that gives sags
_SPARE = 1.1  # what the motion of an erratic hand may add to static forces
_LOOKED = 0.75  # use from which derivatives are worked out
_WATCHED = 6  # members whose use is limited: the most used ones
_COLUMNS = 4  # cylinders whose derivatives are worked out anew in each cycle
_SHIFT = 1e-5  # m of a cylinder, for derivatives by differences
_SOFT = 1.0  # 1/s: near its limit the use rises by this part of what is left
_EVERY = 2  # cycles for which a look is good: in 40 ms a use changes by a hundredth at most


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
    _picked: Index = field(init=False)
    _cycle: int = 0

    def __post_init__(self) -> None:
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


@dataclass
class UseWatch:
    """Watches the use of members and drives at rest, as parts of what the scene's limits allow.

    `picked` are the members of the rows of the last `bound`. Derivatives by the lengths are worked out for a few cylinders at a
    time, for all at once where a use first comes near its limit.
    """

    site: Site
    use: Array = field(init=False)
    _cycle: int = 0
    _slopes: Array | None = None
    _next: int = 0
    picked: Index = field(init=False)

    def bound(self, arm: ArmNow) -> tuple[Array, Array]:
        """Derivatives of what is left of the most used members by the lengths, shape (R, J), and their least rates, (R,)."""
        if self._cycle % _EVERY == 0:
            self._look(arm)
        self._cycle += 1
        count = len(arm.lengths)
        if self._slopes is None:
            return np.empty((0, count)), np.empty(0)
        left = 1 - self.use[self.picked]
        return -self._slopes[self.picked], -_SOFT * np.maximum(left, 0.0)

    def _look(self, arm: ArmNow) -> None:
        """Find the uses, the most used members, and derivatives where they are needed."""
        count = len(arm.lengths)
        columns = np.empty(0, np.intp)
        if self._slopes is not None:
            columns = (self._next + np.arange(min(_COLUMNS, count))) % count
        use = self._find(arm, columns)
        if self._slopes is None and use[0].max() > _LOOKED:
            columns, self._slopes = np.arange(count), np.empty((len(use[0]), count))
            use = self._find(arm, columns)
        self.use, self.picked = use[0], np.empty(0, np.intp)
        if self._slopes is None:
            return
        self._slopes[:, columns] = (use[1:] - use[0]).T / _SHIFT
        self._next = (self._next + len(columns)) % count
        if use[0].max() <= _LOOKED:
            self._slopes = None
            return
        self.picked = np.argsort(-np.rint(1e9 * use[0]), kind="stable")[:_WATCHED]

    def _find(self, arm: ArmNow, columns: Index) -> Array:
        """Use of each member now and with each of some cylinders longer, shape (1 + C, M)."""
        site, limits = self.site, self.site.task.limits
        nodes = arm.state.nodes
        if len(columns):
            moved = arm.q + _SHIFT * arm.inputs_by_length[:, columns].T
            nodes = np.concatenate([nodes, arm.chain.state(moved).nodes])
        found = find_use(site.load_model, site.sections, nodes, limits.safety_factor)
        return _SPARE * np.maximum(found.strength / limits.member_utilisation, found.pressure / limits.actuator_force)

    def name(self, row: int) -> str:
        """Name of the member of a row of `bound`."""
        return self.site.truss.member_names[self.picked[row]]

    @property
    def worst(self) -> tuple[float, str]:
        """Greatest use, with what motion may add, and the member."""
        member = int(np.argmax(self.use))
        return float(self.use[member]), self.site.truss.member_names[member]
