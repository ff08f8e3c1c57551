"""The files that a run leaves behind: reports, plots, film."""

from vgtsim.output.write import (
    clear_folder,
    film,
    naming_folder,
    prepare_file,
    prepare_folder,
    save_log,
    write_outputs,
    write_reports,
)

__all__ = [
    "clear_folder",
    "film",
    "naming_folder",
    "prepare_file",
    "prepare_folder",
    "save_log",
    "write_outputs",
    "write_reports",
]
