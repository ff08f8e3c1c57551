"""How much of their strength the members use, and how fast that may rise in the coming step: statics, cycle by cycle."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from vgtsim.control.arm_now import ArmNow
from vgtsim.site import Site
from vgtsim.statics import find_use

Array = NDArray[np.float64]

_SPARE = 1.1  # what the motion of an erratic hand may add to static forces
_LOOKED = 0.75  # use from which derivatives are worked out
_WATCHED = 6  # members whose use is limited: the most used ones
_COLUMNS = 4  # cylinders whose derivatives are worked out anew in each cycle
_SHIFT = 1e-5  # m of a cylinder, for derivatives by differences
_SOFT = 1.0  # 1/s: near its limit the use rises by this part of what is left
_EVERY = 2  # cycles for which a look is good: in 40 ms a use changes by a hundredth at most


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
    picked: NDArray[np.intp] = field(init=False)

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

    def _find(self, arm: ArmNow, columns: NDArray[np.intp]) -> Array:
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
