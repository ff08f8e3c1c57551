"""The files that a run leaves behind: reports, plots, film."""

from vgtsim.output.folders import (
    LOG,
    PHASES,
    REPLAY,
    find_results,
    list_runs,
    naming_folder,
    prepare_file,
    prepare_folder,
    stage_results,
)
from vgtsim.output.write import film, film_runs, write_mission, write_outputs, write_pdf, write_reports, write_verdict

__all__ = [
    "LOG",
    "PHASES",
    "REPLAY",
    "film",
    "film_runs",
    "find_results",
    "list_runs",
    "naming_folder",
    "prepare_file",
    "prepare_folder",
    "stage_results",
    "write_mission",
    "write_outputs",
    "write_pdf",
    "write_reports",
    "write_verdict",
]
