"""Which parts of the arm may touch which: MuJoCo's 32 contact bits, given out by place along the chain.

Parts are numbered from the mast (0) over the modules (1 to K). Bit 0 is the tank's. Of the others, part i answers to
bit k when i <= k, and seeks bit k when i >= k + 2; so two parts meet if and only if they are two or more places apart.
"""

from __future__ import annotations

TANK = 1
_BITS = 30


def contact_bits(part: int, parts: int) -> tuple[int, int]:
    """Contact type and affinity of a part.

    Long chains have more parts than MuJoCo has bits; their parts are then grouped, and only parts of groups that are
    not neighbours meet.

    Args:
        part: 0 for the mast, 1 to K for the modules.
        parts: K + 1.

    Returns:
        `contype` and `conaffinity`; every part also seeks the tank.
    """
    group = -(-parts // _BITS)
    place, places = part // group, -(-parts // group)
    contype = sum(1 << (k + 1) for k in range(places - 2) if place <= k)
    affinity = sum(1 << (k + 1) for k in range(places - 2) if place >= k + 2)
    return contype, affinity | TANK
