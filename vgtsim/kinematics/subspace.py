"""Inputs that an arm may use on its way: static longerons keep their lengths, and linear rows, such as coupling, hold.

The lengths of static longerons bend the subspace of an octahedron's poses (section 3.4.2), so inputs come back to it by
Newton's iteration, each step the least change of the inputs.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array, Mask
from vgtsim.errors import AssemblyError
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.state import State

_CLOSE = 1e-12  # error of a row that ends the iteration, m and rad: a thousandth of what a chain allows
_STEPS = 20  # of at most 0.2 each: what is farther off than four is no guess
_MOST = 0.2  # greatest change of an input in one step, m and rad: guesses may be a bend away
_DEPENDENT = 1e-9  # singular value over the greatest, at which a row repeats the others: coupled octahedra have them


@dataclass(frozen=True, eq=False)
class Subspace:
    """Inputs of an arm, shape (n,), with rows A q = b, A of shape (r, n), that keep all static longerons their lengths."""

    chain: Chain
    rows: Array = field(default_factory=lambda: np.empty((0, 0)))
    values: Array = field(default_factory=lambda: np.empty(0))

    @cached_property
    def _linear(self) -> Array:
        """The rows, shape (r, n), those of no coupling too."""
        return self.rows.reshape(-1, self.chain.layout.inputs)

    @cached_property
    def bent(self) -> bool:
        """Whether it is more than a linear one."""
        return len(self.chain.layout.static) > 0

    @cached_property
    def whole(self) -> bool:
        """Whether all inputs are in it."""
        return not self.bent and not len(self.values)

    def basis(self, state: State) -> Array:
        """Directions that stay in it to first order, orthonormal columns, shape (b, n, f), at inputs that are in it."""
        _, value, right = np.linalg.svd(self._slopes(state))
        rank = int(np.max(np.sum(value > _DEPENDENT * value[:, :1], axis=1), initial=0))
        return np.swapaxes(right[:, rank:], 1, 2)

    def find_errors(self, q: Array) -> Array:
        """Greatest error of any row of inputs, shape (b, n), m and rad, shape (b,); infinite where they do not assemble."""
        state = self.chain.state(q)
        off = np.abs(self._errors(state)).max(axis=1, initial=0.0)
        sound = np.all([part.placed.all(axis=1) for part in state.parts], axis=0)
        return np.where(sound, off, np.inf)

    def project(self, q: Array) -> Array:
        """Inputs near given ones, shape (b, n), that are in it; an AssemblyError tells the residual where none are near."""
        found, good = self.approach(q)
        if not good.all():
            off = float(self.find_errors(found[~good]).max())
            raise AssemblyError(
                self.chain.manipulator.name, off, "no pose near that keeps static longerons and coupling"
            )
        return found

    def approach(self, q: Array) -> tuple[Array, Mask]:
        """Inputs near given ones, shape (b, n), and which of them are in it, shape (b,)."""
        if self.whole:
            return q, np.ones(len(q), bool)
        found, left = np.array(q, float), np.arange(len(q))
        for _ in range(_STEPS):
            state = self.chain.state(found[left])
            error = self._errors(state)
            off = ~(np.abs(error).max(axis=1) <= _CLOSE)
            left = left[off]
            if not len(left):
                break
            slope = self._slopes(state)[off]
            step = -(np.linalg.pinv(slope, rcond=_DEPENDENT) @ error[off][..., None])[..., 0]
            longest = np.abs(step).max(axis=1, keepdims=True)
            found[left] += step * np.minimum(1.0, _MOST / np.maximum(longest, _MOST))
        good = np.ones(len(q), bool)
        good[left] = False
        return found, good

    def _errors(self, state: State) -> Array:
        """Errors of the linear rows and then of static legs, shape (b, r + S)."""
        layout, linear = self.chain.layout, state.q @ self._linear.T - self.values
        if not self.bent:
            return linear
        return np.concatenate([linear, state.legs[:, layout.actuators :] - layout.static], axis=1)

    def _slopes(self, state: State) -> Array:
        """Derivatives of the errors by the inputs, shape (b, r + S, n)."""
        linear = np.broadcast_to(self._linear, (len(state.q), *self._linear.shape))
        if not self.bent:
            return linear
        return np.concatenate([linear, state.leg_slopes[:, self.chain.layout.actuators :]], axis=1)
