"""All that is wrong with a scene before its tour is planned: every refusal, and every goal out of reach."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from vgtsim.description import AddStep, begins_inside
from vgtsim.errors import DescriptionError, VgtError
from vgtsim.planning.checks import check_passage, find_faults
from vgtsim.planning.entry import check_hoist, check_mouth
from vgtsim.planning.tour import configure
from vgtsim.site import Site


def inspect_site(site: Site) -> list[VgtError]:
    """Everything that keeps a scene from being planned, as far as that shows without its ways: goals are solved one by one.

    A goal is solved from the shape at the goal before it that could be solved.
    """
    faults = [*find_faults(site), *_find_entry_faults(site)]
    wrong = [error.key for error in faults if isinstance(error, DescriptionError)]
    if len(wrong) < len(faults) or any(not key.startswith("motion.goals.") for key in wrong):
        return faults
    shape = site.start
    for index, goal in enumerate(site.task.motion.goals):
        if f"motion.goals.{index}.position" in wrong:  # it is in something, which nothing can solve
            continue
        try:
            shape = configure(site, goal, shape)
        except VgtError as error:
            faults.append(error)
    return faults


def _find_entry_faults(site: Site) -> Iterator[VgtError]:
    """What keeps the stowed arm, with its line of conveyance, from coming through the riser, whatever its way."""
    steps = site.task.mission
    if not steps or begins_inside(steps):
        return
    grows = any(isinstance(step, AddStep) for step in steps)
    line = partial(check_passage, q=site.chain.stowed[None])
    for check in (check_mouth, partial(check_hoist, grows=grows), line):
        try:
            check(site)
        except VgtError as error:
            yield error
