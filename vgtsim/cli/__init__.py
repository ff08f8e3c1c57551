"""The command line: each stage of the spine is a verb that leaves a file."""

from vgtsim.cli import arms, drawings, files, live, new, positions, runs, studies
from vgtsim.cli.application import Status, app, main

__all__ = ["Status", "app", "arms", "drawings", "files", "live", "main", "new", "positions", "runs", "studies"]
