"""Arms whose double octahedra are given a joint offset."""

from __future__ import annotations

from vgtsim.description import Manipulator
from vgtsim.description.sections import Block

OFFSET = 0.127  # m
POST = Block(diameter=0.0635, material="steel")


def with_offset(arm: Manipulator, offset: float = OFFSET) -> Manipulator:
    """The arm with a joint offset in each of its double octahedra."""
    modules = tuple(
        module.model_copy(update={"joint_offset": offset, "block": "post", "straight": module.straight + offset})
        if module.kind == "double_octahedral"
        else module
        for module in arm.modules
    )
    return arm.model_copy(update={"modules": modules, "blocks": {"post": POST}})
