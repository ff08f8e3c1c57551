"""The verb for many runs."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from vgtsim.cli.application import ERR, OUT, OutFolder, app, finish, list_files

if TYPE_CHECKING:
    from vgtsim.study import Result


@app.command(epilog="Example: vgtsim study arm9_payload --workers 4")
def study(
    study_name: Annotated[
        Path, typer.Argument(help="TOML file of a study, or name of a shipped one.", show_default=False)
    ],
    out: OutFolder = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes [default: one for each core].")] = None,
    cluster: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler, tcp://HOST:8786, in place of processes.")
    ] = None,
) -> None:
    """Repeat a verb over a grid, a sample or a list of cases of a scene; the same command goes on where one ended."""
    from rich.progress import Progress

    from vgtsim.description import load_study
    from vgtsim.study import conduct_study, count_cores, use_cluster, use_processes

    asked = load_study(study_name)
    where = use_cluster(cluster) if cluster else use_processes(workers or count_cores())
    with where as engine, Progress(console=ERR, disable=not ERR.is_terminal) as bar:
        task = bar.add_task(asked.task.name)
        folder = out or Path("out") / asked.task.name
        found = conduct_study(asked, folder, engine, lambda done, total: bar.update(task, completed=done, total=total))
    OUT.print(_summarise(found, asked.task.title or asked.task.name))
    failures = Counter(text.split(":")[0] for text in found.table["error"].to_pylist() if text is not None)
    for kind, count in failures.items():
        OUT.print(f"{count} cases failed: {kind}")
    OUT.print(f"{len(found.table)} cases, {found.done} of them now; {found.processor_s:.1f} s of processor time in all")
    list_files(*found.files)
    finish(failures.total() < len(found.table), None)


def _summarise(found: Result, title: str) -> Table:
    """Least, middle and greatest figure of each column of numbers."""
    import numpy as np

    table = Table("column", "least", "median", "greatest", title=title)
    for name, column in found.numbers.items():
        there = column[np.isfinite(column)]
        if there.size:
            table.add_row(name, *(f"{value:.4g}" for value in (there.min(), np.median(there), there.max())))
    return table
