"""Whether the strokes of every module's actuators, all combinations of them, are clear of singularities."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import AssemblyError, UnusualWarning
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.modules.sets import ModuleSet

Array = NDArray[np.float64]


def check_strokes(chain: Chain) -> None:
    """Refuse an arm with a module whose strokes hold a singularity; each kind has its proof or its search.

    A module that says why its strokes are used `unproved` is warned of.

    Raises:
        AssemblyError: Lengths within the strokes do not make the module; it is named, with its keys.
        SingularityError: The module, the smallest singular value where the way ends, and the member.
    """
    low, high = chain.stroke
    done: set[tuple[object, ...]] = set()
    for place in chain.layout.places:
        modules = place.modules
        for m in range(len(modules.names)):
            own = place.lengths[m][modules.actuated[m]]
            alike = (modules.dimensions(m), *low[own], *high[own], *modules.straight[m])
            if alike not in done:
                done.add(alike)
                _check(chain, modules.one(m), low[own], high[own])


def _check(chain: Chain, own: ModuleSet, low: Array, high: Array) -> None:
    module = next(module for module in chain.manipulator.active if module.name == own.names[0])
    try:
        own.check_strokes(low, high)
    except AssemblyError as error:
        strokes = ", ".join(
            f"{a:.4g} to {b:.4g} m" for a, b in sorted(set(zip(low.tolist(), high.tolist(), strict=True)))
        )
        index = chain.manipulator.modules.index(module)
        if module.unproved:
            message = f"modules.{index}.unproved: strokes of {strokes} are accepted though {error}"
            warnings.warn(message, UnusualWarning, stacklevel=3)
            return
        narrow = (
            "narrow the cylinder's retracted length and stroke, or say in the module's key `unproved` why it may be"
        )
        error.args = (f"modules.{index}, cylinder strokes of {strokes}: {error}; {narrow}",)
        raise
