"""A kind of module as the description names it: its nodes and members in the truss, and how its set is made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from vgtsim.kinematics.modules.sets import ModuleSet
from vgtsim.kinematics.modules.static_section import StaticSection

TRIANGLE = ((0, 1), (1, 2), (2, 0))  # edges 12, 23, 31 of a face, as indices of its corners

Groups = dict[str, list[int]]  # node indices of a module: `base`, `top`, and what lies between


class PlannedMember(NamedTuple):
    """One member of a module between two nodes, by index; numbers are counted from 1 within a role.

    The role is `longeron`, `cross_longeron` or `actuator`; the section is the name of its tube or cylinder.
    """

    role: str
    section: str
    first: int
    second: int
    number: int


@dataclass(frozen=True)
class Kind:
    """One kind of module. A function takes the module's description, whose class belongs to the kind.

    Attributes:
        plan: The members between its nodes, battens left out.
        groups: Names of the groups of three nodes that it adds between base and top, in order.
        top: Corners of its top that are nodes of its own; the others it shares with its base.
        battens: Edges of its top that are members, as pairs of corners.
        make_set: From modules of this kind and the arm's face side, m, to their set; absent for a static kind.
        make_static: From a module and the arm's face side to its section; absent for a kind with actuators.
    """

    plan: Callable[[Any, Groups], list[PlannedMember]]
    groups: Callable[[Any], tuple[str, ...]] = lambda _: ()
    top: tuple[int, ...] = (0, 1, 2)
    battens: tuple[tuple[int, int], ...] = TRIANGLE
    make_set: Callable[[Any, float], ModuleSet] | None = None
    make_static: Callable[[Any, float], StaticSection] | None = None
