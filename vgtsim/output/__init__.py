"""The files that a run leaves behind: reports, plots, film."""

from vgtsim.output.folders import naming_folder, prepare_file, prepare_folder
from vgtsim.output.staging import LOG, REPLAY, find_results, stage_results
from vgtsim.output.write import film, write_outputs, write_pdf, write_reports, write_verdict

__all__ = [
    "LOG",
    "REPLAY",
    "film",
    "find_results",
    "naming_folder",
    "prepare_file",
    "prepare_folder",
    "stage_results",
    "write_outputs",
    "write_pdf",
    "write_reports",
    "write_verdict",
]
