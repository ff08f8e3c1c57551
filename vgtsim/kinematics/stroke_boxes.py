"""Whether the strokes of every module's actuators, all combinations of them, are clear of singularities."""

from __future__ import annotations

from vgtsim.kinematics.chain import Chain


def check_strokes(chain: Chain) -> None:
    """Refuse an arm with a module whose strokes hold a singularity; each kind has its proof or its search.

    Raises:
        AssemblyError: Lengths within the strokes do not make the module; it is named.
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
                modules.one(m).check_strokes(low[own], high[own])
