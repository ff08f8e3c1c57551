"""What moves the arm of an environment: kinematics alone, or the plant."""

from __future__ import annotations

from vgtsim.arrays import Array
from vgtsim.errors import AssemblyError, DivergenceError, SingularityError, StoppedError
from vgtsim.kinematics import Chain, State
from vgtsim.plant import Plant
from vgtsim.site import Site


class FastTier:
    """Kinematics: the arm is where its lengths put it, at once.

    It has a `state` of one row, its `lengths`, shape (J,), m, and the `feed` of its mast, m.
    """

    def __init__(self, site: Site) -> None:
        self._chain = site.chain

    def reset(self, inputs: Array, feed: float) -> None:
        """Stand at rest in a posture."""
        self.state, self.feed = self._chain.state(inputs[None]), feed
        self.lengths = self.state.lengths[0]

    def move(self, lengths: Array, feed: Array) -> str:
        """Go through lengths, shape (S, J), and feeds, shape (S,), at every step; say what went wrong, or nothing.

        The last lengths count.
        """
        try:
            self.state = step_near(self._chain, lengths[-1], self.state)
        except (AssemblyError, SingularityError) as error:
            return f"no posture has these lengths: {error}"
        self.lengths, self.feed = lengths[-1], float(feed[-1])
        return ""


class ExactTier:
    """The plant of a run, step by step, with its closure correction, contacts and divergence."""

    def __init__(self, site: Site, timestep: float) -> None:
        """Make the plant, which keeps no records, at a time step, s."""
        self._chain, self.plant = site.chain, Plant(site, timestep=timestep, record_rate=0)

    def reset(self, inputs: Array, feed: float) -> None:
        """See `FastTier.reset`."""
        state = self.plant.reset(inputs=inputs, feed=feed)
        self.state, self.lengths, self.feed = self._chain.state(inputs[None]), state.lengths, state.feed

    def move(self, lengths: Array, feed: Array) -> str:
        """See `FastTier.move`: the last state counts."""
        plant = self.plant
        try:
            for row, height in zip(lengths, feed, strict=True):
                plant.command(row, feed=float(height))
                plant.step()
            state = plant.state
            self.state = step_near(self._chain, state.lengths, self.state)
        except (AssemblyError, DivergenceError, SingularityError, StoppedError) as error:
            return str(error)
        self.lengths, self.feed = state.lengths, state.feed
        return ""


Tier = FastTier | ExactTier


def step_near(chain: Chain, lengths: Array, near: State) -> State:
    """State of lengths, shape (J,), m, from one near by: Newton, or the way with proof where that fails.

    Raises:
        AssemblyError: A module does not assemble.
        SingularityError: A module would have to pass a singularity on the way.
    """
    return chain.follow(lengths, near) or chain.state(chain.inputs_from_lengths(lengths, near.q[0])[None])
