"""A progress bar on a terminal, nothing in a pipe."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from typing import TypeVar

import mujoco
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from vgtsim.planning import Tour

_Item = TypeVar("_Item")
_EVERY = 50  # steps between redraws


def show_progress(steps: Iterable[_Item], program: Tour, data: mujoco.MjData) -> Iterator[_Item]:
    """Pass steps through, showing simulated and wall time on a terminal.

    Args:
        steps: What drives the loop.
        program: Tells how many steps the motion takes; the holds come on top.
        data: Tells the simulated time.

    Yields:
        The steps.
    """
    if not sys.stderr.isatty():
        yield from steps
        return
    total = sum(len(leg.lengths) - 1 for leg in program.legs)
    columns = (TextColumn("simulating"), BarColumn(), TextColumn("{task.fields[simulated]:.1f} s simulated,"))
    with Progress(*columns, TimeElapsedColumn(), TextColumn("wall"), console=Console(stderr=True)) as bar:
        task = bar.add_task("simulating", total=total, simulated=0.0)
        for count, step in enumerate(steps):
            if count % _EVERY == 0:
                bar.update(task, completed=min(count, total), simulated=data.time)
            yield step
