"""A progress bar on a terminal, nothing in a pipe."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

_EVERY = 50  # steps between redraws: some tens of milliseconds


@contextmanager
def show_progress(total: int) -> Iterator[Callable[[float], None]]:
    """Show steps done of a total, and simulated and wall time; gives what is called with the simulated time, s, each step.

    The steps of holds come on top of the total, at which the bar then stays.
    """
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    columns = (TextColumn("simulating"), BarColumn(), TextColumn("{task.fields[simulated]:.1f} s simulated,"))
    with Progress(*columns, TimeElapsedColumn(), TextColumn("wall"), console=Console(stderr=True)) as bar:
        task = bar.add_task("simulating", total=total, simulated=0.0)
        done = 0

        def tick(simulated: float) -> None:
            nonlocal done
            done += 1
            if done % _EVERY == 0:
                bar.update(task, completed=min(done, total), simulated=simulated)

        yield tick
