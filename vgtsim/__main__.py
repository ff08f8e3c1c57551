"""The command line as a module: `python -m vgtsim`."""

from vgtsim.cli import main

main()
