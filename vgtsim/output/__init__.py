"""What a run leaves behind: reports, plots, film."""

from vgtsim.output.write import prepare_folder, write_outputs

__all__ = ["prepare_folder", "write_outputs"]
