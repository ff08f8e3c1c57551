"""Verbs for the files that a user writes."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from vgtsim.cli.application import app


@app.command(epilog="Example: vgtsim schema arm > arm.json")
def schema(
    kind: Annotated[
        Literal["arm", "tank", "scene", "path", "catalogue"], typer.Argument(help="Kind of file.", show_default=False)
    ],
) -> None:
    """Print the JSON schema of a kind of file; an editor takes it from the file's first line, `#:schema arm.json`."""
    from vgtsim.description.reference import write_schema

    typer.echo(write_schema(kind), nl=False)
