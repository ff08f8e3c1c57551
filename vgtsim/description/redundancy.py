"""How an arm uses its redundancy, as a scene or a command says it: a method, objectives by name, coupled modules."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Annotated

from pydantic import AfterValidator

from vgtsim.description.modules import Module
from vgtsim.description.schema import closest

OBJECTIVES = (
    "actuator_force",
    "clearance",
    "condition_number",
    "in_plane",
    "length_variation",
    "mid_stroke",
    "stroke_barrier",
    "utilisation",
)
TOOL_ROWS = 5  # of a tool goal: three of the position, two of the direction

Pairs = tuple[tuple[str, str], ...]


def split_objective(text: str) -> tuple[str, float]:
    """Split an objective written `NAME` or `NAME:WEIGHT` into name and weight; the weight is 1 if none is written.

    Raises:
        ValueError: The name is not known, or the weight is no number above zero. The message says what is allowed.
    """
    name, colon, number = text.partition(":")
    if name not in OBJECTIVES:
        raise ValueError(f"NAME or NAME:WEIGHT of an objective{closest(name, OBJECTIVES)}")
    try:
        weight = float(number) if colon else 1.0
    except ValueError:
        weight = -1.0
    if not 0 < weight < inf:
        raise ValueError(f"{name} with a weight that is a number above zero")
    return name, weight


def _known(text: str) -> str:
    split_objective(text)
    return text


ObjectiveName = Annotated[str, AfterValidator(_known)]


def choose_coupling(pairs: Pairs | None, modules: Sequence[Module]) -> tuple[tuple[int, int], ...]:
    """Choose the active modules that follow others: indices (follower, leader) from pairs of such names.

    No pairs stand for those of section 8.1: the two modules nearest the mast and the two nearest the tool, as far as
    these differ.

    Raises:
        ValueError: The arm cannot be coupled so, or too few inputs are left for a tool goal. The message says what is
            allowed.
    """
    names, freedom = tuple(module.name for module in modules), [module.freedom for module in modules]
    if pairs is None:
        ends = ((0, 1), (len(names) - 1, len(names) - 2))[: min(len(names) // 2, 2)]
        chosen = tuple(pair for pair in ends if modules[pair[0]].kind == modules[pair[1]].kind)
    else:
        chosen = tuple((_index(follower, names), _index(leader, names)) for follower, leader in pairs)
    if not chosen:
        raise ValueError(f"at least one pair [follower, leader] of the active modules: {', '.join(names)}")
    followers, leaders = [pair[0] for pair in chosen], {pair[1] for pair in chosen}
    if len(set(followers)) < len(followers) or leaders & set(followers):
        raise ValueError("pairs [follower, leader] in which no module follows twice, or leads and follows")
    for follower, leader in chosen:
        if modules[follower].kind != modules[leader].kind:
            kinds = f"{names[follower]} is {modules[follower].kind}, {names[leader]} {modules[leader].kind}"
            raise ValueError(f"pairs of modules of one kind; {kinds}")
    left = sum(freedom) - sum(freedom[follower] for follower in followers)
    if left < TOOL_ROWS:
        most = max(0, len(names) - -(-TOOL_ROWS // max(freedom)))
        raise ValueError(f"at most {most} pairs: a tool goal has {TOOL_ROWS} rows, and {left} inputs would be left")
    return chosen


def _index(name: str, modules: tuple[str, ...]) -> int:
    if name not in modules:
        raise ValueError(f"pairs [follower, leader] of active modules; {name!r} is none{closest(name, modules)}")
    return modules.index(name)
