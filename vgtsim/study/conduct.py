"""A whole study: what is not done yet is done, and the table is written."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vgtsim.arrays import Array
from vgtsim.description import Study
from vgtsim.output import naming_folder, prepare_folder
from vgtsim.replacing import replacing
from vgtsim.study.cases import plan_study
from vgtsim.study.dispatch import Row, dispatch
from vgtsim.study.engines import Engine
from vgtsim.study.records import Records

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True)
class Result:
    """The table of a study, its columns of numbers, cases done in this go, processor time of all cases, s, and files."""

    table: pa.Table
    numbers: Mapping[str, Array]
    done: int
    processor_s: float
    files: tuple[Path, ...]


def conduct_study(
    study: Study, out_dir: str | Path, engine: Engine, advance: Callable[[int, int], None] | None = None
) -> Result:
    """Do the cases of a study that its folder does not hold yet, and write `table.parquet`, `table.csv` and `plots.png`.

    If given, `advance` is called with the number of written cases and of all. The same study gives the same table, bit for bit,
    in whatever order and on however many workers its cases are done.

    Raises:
        DescriptionError: The study is wrong, or the folder cannot be written.
        ClusterError: The cluster is gone; the same call goes on where it ended.
    """
    from vgtsim.output.figure import save_figure  # matplotlib, which workers do without
    from vgtsim.output.study_plot import plot_study

    tell = advance or (lambda *_: None)
    folder = Path(out_dir).absolute()
    order, cases = plan_study(study, folder)
    prepare_folder(folder)
    with naming_folder(folder):
        records = Records(folder)
        try:
            unique = {case.digest: case for case in cases}
            waiting = [case for digest, case in unique.items() if digest not in records.done]
            total, known, before = len(unique), len(records.done), len(unique) - len(waiting)

            def receive(rows: Sequence[Row]) -> None:
                records.add(rows)
                tell(before + len(records.done) - known, total)

            tell(before, total)
            if waiting:
                dispatch(order, waiting, engine, receive)
        finally:
            records.close()
        table, spent = records.tabulate(order, cases)
        files = _write_table(table, folder)
        plots, numbers = folder / "plots.png", _find_numbers(table)
        keys, figures = (
            {name: numbers[name] for name in names if name in numbers} for names in (order.keys, order.columns)
        )
        save_figure(plot_study(keys, figures, study.task.title or study.task.name), plots)
    return Result(table, numbers, len(waiting), spent, (*files, plots))


def _find_numbers(table: pa.Table) -> dict[str, Array]:
    """The columns of numbers and truth values, shape (C,) each, NaN where there is none."""
    names = [field.name for field in table.schema if str(field.type) in ("double", "int64", "bool")]
    return {name: table[name].to_numpy().astype(float) for name in names if name != "case"}


def _write_table(table: pa.Table, folder: Path) -> tuple[Path, Path]:
    from pyarrow import csv, parquet

    whole, text = folder / "table.parquet", folder / "table.csv"
    with replacing(whole) as partial:
        parquet.write_table(table, partial)
    with replacing(text) as partial:
        csv.write_csv(table, partial)
    return whole, text
