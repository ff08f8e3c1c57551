"""What moves the arm of an environment: kinematics alone, or the plant."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import AssemblyError, DivergenceError, SingularityError, SingularPoseError, StoppedError
from vgtsim.kinematics import Chain
from vgtsim.plant import Plant
from vgtsim.site import Site

Array = NDArray[np.float64]

_CLOSE, _ITERATIONS = 1e-9, 8  # m, and Newton's steps to it: three from half a second before


class Tier(Protocol):
    """An arm with its inputs, shape (n,), its lengths, shape (J,), m, and the feed of its mast, m."""

    inputs: Array
    lengths: Array
    feed: float

    def reset(self, inputs: Array, feed: float) -> None:
        """Stand at rest in a posture."""

    def move(self, lengths: Array, feed: Array) -> str:
        """Go through lengths, shape (S, J), and feeds, shape (S,), at every step; say what went wrong, or nothing."""
        ...


class FastTier:
    """Kinematics: the arm is where its lengths put it, at once."""

    def __init__(self, site: Site) -> None:
        """Stand nowhere yet."""
        self._chain = site.chain

    def reset(self, inputs: Array, feed: float) -> None:
        """See `Tier.reset`."""
        self.inputs, self.lengths, self.feed = inputs, self._chain.lengths(inputs), feed

    def move(self, lengths: Array, feed: Array) -> str:
        """See `Tier.move`: the last lengths count."""
        try:
            self.inputs = follow(self._chain, lengths[-1], self.inputs)
        except (AssemblyError, SingularityError, SingularPoseError) as error:
            return f"no posture has these lengths: {error}"
        self.lengths, self.feed = lengths[-1], float(feed[-1])
        return ""


class ExactTier:
    """The plant of a run, step by step, with its closure correction, contacts and divergence."""

    def __init__(self, site: Site, timestep: float) -> None:
        """Make the plant, which keeps no records, at a time step, s."""
        self._chain, self.plant = site.chain, Plant(site, timestep=timestep, record_rate=0)

    def reset(self, inputs: Array, feed: float) -> None:
        """See `Tier.reset`."""
        state = self.plant.reset(inputs=inputs, feed=feed)
        self.inputs, self.lengths, self.feed = inputs, state.lengths, state.feed

    def move(self, lengths: Array, feed: Array) -> str:
        """See `Tier.move`: the last state counts."""
        plant = self.plant
        try:
            for row, height in zip(lengths, feed, strict=True):
                plant.command(row, feed=float(height))
                plant.step()
            state = plant.state
            self.inputs = follow(self._chain, state.lengths, self.inputs)
        except (AssemblyError, DivergenceError, SingularityError, SingularPoseError, StoppedError) as error:
            return str(error)
        self.lengths, self.feed = state.lengths, state.feed
        return ""


def follow(chain: Chain, lengths: Array, start: Array) -> Array:
    """Inputs of lengths, shape (J,), m, near those of a start, shape (n,): Newton, or the way with proof where that fails.

    Raises:
        AssemblyError: A module does not assemble.
        SingularityError: A module would have to pass a singularity on the way.
        SingularPoseError: A module is singular.
    """
    q = start
    for _ in range(_ITERATIONS):
        try:
            off = lengths - chain.lengths(q)
            if np.abs(off).max() < _CLOSE:
                return q
            q = q + chain.input_rates(q) @ off
        except AssemblyError:
            break
    return np.asarray(chain.inputs_from_lengths(lengths, start))
