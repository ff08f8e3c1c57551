"""What a run leaves behind: reports, plots, film."""

from vgtsim.output.write import film, prepare_folder, write_outputs

__all__ = ["film", "prepare_folder", "write_outputs"]
