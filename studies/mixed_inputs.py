"""Chains whose modules take conventional inputs (actuator lengths) or canonical ones, each as it pleases (chapter 4).

A row y has the inputs of the active modules from the mast to the tool: of a conventional module the lengths of its
actuators in the order of its legs, of any other its canonical inputs, see `vgtsim.kinematics.chain`. Leading dimensions
are batches. Static longerons keep their lengths.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index
from vgtsim.description import closest
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.chain import Chain


@dataclass(frozen=True)
class Share:
    """What one active module has of the rows that a chain works with.

    Attributes:
        inputs: Its canonical inputs among the chain's n.
        actuators: Its actuators among the chain's J, in the order of its legs.
        own: Its inputs in the mixed row y.
        conventional: Whether those are its actuator lengths.
    """

    name: str
    inputs: Index
    actuators: Index
    own: slice
    conventional: bool


@dataclass(frozen=True)
class MixedInputs:
    """Kinematics of a chain by inputs of either kind; w inputs in all. Made by `mix_inputs`.

    Attributes:
        conventional: Names of the modules whose inputs are actuator lengths.
    """

    chain: Chain
    conventional: frozenset[str]

    @cached_property
    def shares(self) -> tuple[Share, ...]:
        """One for each active module, from the mast to the tool."""
        layout, found, start = self.chain.layout, {}, 0
        for place in layout.places:
            for m, a in enumerate(place.active):
                found[int(a)] = (place.columns[m], place.lengths[m][place.modules.actuated[m]])
        shares = []
        for a, name in enumerate(layout.names):
            inputs, actuators = found[a]
            chosen = name in self.conventional
            stop = start + len(actuators if chosen else inputs)
            shares.append(Share(name, inputs, actuators, slice(start, stop), chosen))
            start = stop
        return tuple(shares)

    @property
    def size(self) -> int:
        """Number of inputs w."""
        return self.shares[-1].own.stop if self.shares else 0

    def from_canonical(self, q: ArrayLike) -> Array:
        """Row y, shape (..., w), of canonical inputs, shape (..., n).

        Raises:
            AssemblyError: As `Chain.lengths`.
        """
        x = np.asarray(q, float)
        y = np.empty((*x.shape[:-1], self.size))
        lengths = self.chain.lengths(q) if self.conventional else None
        for share in self.shares:
            source, columns = (lengths, share.actuators) if share.conventional else (x, share.inputs)
            assert source is not None
            y[..., share.own] = source[..., columns]
        return y

    def canonical(self, y: ArrayLike, start: ArrayLike | None = None) -> Array:
        """Canonical inputs, shape (..., n), of a row y, shape (..., w).

        Conventional modules stay on the assembly mode of their start, with proof. The start is canonical inputs on the
        wanted modes, shape (..., n), or absent for the straight pose; entries of canonical modules are ignored.

        Raises:
            AssemblyError: A module does not assemble; it is named.
            SingularityError: A module would have to pass a singularity on the way.
        """
        chain, row = self.chain, np.asarray(y, float)
        if row.shape[-1:] != (self.size,):
            raise ValueError(f"inputs of shape {row.shape}; {chain.manipulator.name} so mixed takes (..., {self.size})")
        batch, held = row.shape[:-1], chain.straight
        lengths = np.broadcast_to(chain.lengths(chain.straight), (*batch, chain.layout.actuators)).copy()
        near = None if start is None else np.array(start, float)
        for share in self.shares:
            if share.conventional:
                lengths[..., share.actuators] = row[..., share.own]
            elif near is not None:  # held at the straight pose while the others are followed
                near[..., share.inputs] = held[share.inputs]
        q = chain.inputs_from_lengths(lengths, near)
        for share in self.shares:
            if not share.conventional:
                q[..., share.inputs] = row[..., share.own]
        return q


def mix_inputs(chain: Chain, conventional: Collection[str]) -> MixedInputs:
    """A chain of which the named active modules take actuator lengths, and all others canonical inputs.

    Raises:
        DescriptionError: A name is of no active module.
    """
    for name in conventional:
        if name not in chain.layout.names:
            active = f"an active module of {chain.manipulator.name}{closest(name, chain.layout.names)}"
            raise DescriptionError(None, "conventional inputs", repr(name), active)
    return MixedInputs(chain, frozenset(conventional))
