"""What an arm hangs from and carries, and which of its parts may touch which.

Parts are numbered from the mast (0) over the modules (1 to K). Bit 0 of MuJoCo's contact bits is the tank's. Of the
others, part i answers to bit k when i <= k, and seeks bit k when i >= k + 2; so two parts meet if and only if they are
two or more places apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from vgtsim.arrays import Array
from vgtsim.description import Payload
from vgtsim.geometry import MastPipe
from vgtsim.kinematics import Chain, MemberInertia, kind_of, make_hub_masses, make_line_masses, make_member_inertia

TANK = 1  # contact bit of the tank
_BITS = 30  # of MuJoCo's 32, less the tank's and the sign


@dataclass(frozen=True)
class MastDuty:
    """Least and greatest place of the mast, m above its working depth or rad of turn, greatest force or torque, and rate."""

    range: tuple[float, float]
    force: float
    rate: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Rigging:
    """An arm with what it hangs from and carries, and how its cylinders are held.

    Attributes:
        feed: How the mast is lifted; `turn` how it is turned, absent where it is not.
        reference: Inputs of the reference pose, shape (n,): where the model stands when it is reset.
        timestep: Of the simulation, s; it sets the closures' time constants.
        servo_stiffness, servo_damping: N/m and N·s/m.
        elastic: Whether each tube is two halves with a spring of stiffness EA/L between them.
        lumped: Whether the members' mass sits in their hubs.
        guided: Whether a guide holds the mast sideways; without one it can touch the riser.
        limited: Whether strokes, commands and speeds are limited, idle spins damped and contacts softened as model files
            have it; a plant goes where it is sent.
        line: Mass of the line of conveyance per length, kg/m, which hangs on the faces.
    """

    chain: Chain
    mast: MastPipe
    feed: MastDuty
    payload: Payload
    reference: Array
    timestep: float
    servo_stiffness: float
    servo_damping: float
    elastic: bool = False
    lumped: bool = False
    guided: bool = True
    limited: bool = False
    line: float = 0.0
    turn: MastDuty | None = None

    @cached_property
    def nodes(self) -> Array:
        """Nodes of the reference pose, shape (N, 3), m, in frame G."""
        return self.chain.nodes(self.reference)

    @cached_property
    def inertia(self) -> MemberInertia:
        """Masses of the members as they are simulated."""
        return make_member_inertia(self.chain, split=self.elastic, lumped=self.lumped)

    @cached_property
    def hub_masses(self) -> Array:
        """Masses of the nodes as they are simulated, shape (N,), kg."""
        hubs = make_hub_masses(self.chain, lumped=self.lumped)
        return hubs + make_line_masses(self.chain, self.line)

    def bits(self, module: int) -> dict[str, int]:
        """Contact type and affinity of a module, -1 for the mast; a hinge counts with the module below."""
        modules = self.chain.manipulator.modules
        part = module + 1 - sum(len(kind_of(item).top) < 3 for item in modules[: module + 1])
        contype, conaffinity = contact_bits(part, len(modules) + 1)
        return {"contype": contype, "conaffinity": conaffinity}


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
