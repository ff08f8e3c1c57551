"""Which parts of the arm may touch which: MuJoCo's 32 contact bits, given out by place along the chain.

Parts are numbered from the mast (0) over the modules (1 to K). Bit 0 is the tank's. Of the others, part i answers to
bit k when i <= k, and seeks bit k when i >= k + 2; so two parts meet if and only if they are two or more places apart.
"""

from __future__ import annotations

from vgtsim.description import Manipulator
from vgtsim.kinematics import kind_of

TANK = 1
_BITS = 30  # of MuJoCo's 32, less the tank's and the sign


def contact_bits(part: int, parts: int) -> tuple[int, int]:
    """Contact type and affinity of a part: 0 for the mast, 1 to K for the modules, `parts` being K + 1.

    Long chains have more parts than MuJoCo has bits; their parts are then grouped, and only parts of groups that are
    not neighbours meet. Every part also seeks the tank.
    """
    group = -(-parts // _BITS)
    place, places = part // group, -(-parts // group)
    contype = sum(1 << (k + 1) for k in range(places - 2) if place <= k)
    affinity = sum(1 << (k + 1) for k in range(places - 2) if place >= k + 2)
    return contype, affinity | TANK


def module_bits(manipulator: Manipulator, module: int) -> dict[str, int]:
    """Contact type and affinity of a module, -1 for the mast; a hinge counts with the module below it, whose nodes it shares."""
    modules = manipulator.modules
    part = module + 1 - sum(len(kind_of(item).top) < 3 for item in modules[: module + 1])
    contype, conaffinity = contact_bits(part, len(modules) + 1)
    return {"contype": contype, "conaffinity": conaffinity}
