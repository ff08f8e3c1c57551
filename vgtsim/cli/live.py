"""The verb for an arm that a person drives in a browser."""

from __future__ import annotations

import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from vgtsim.cli.application import OUT, OutFolder, SceneName, app


@app.command(epilog="Example: vgtsim live type_ii_reach --no-open")
def live(
    scene_name: SceneName,
    out: OutFolder = None,
    host: Annotated[str, typer.Option(help="Address to serve at; 0.0.0.0 lets other machines in.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to serve at; 0 takes any that is free.")] = 8080,
    record: Annotated[bool, typer.Option("--record", help="Record from the start.")] = False,
    open_page: Annotated[bool, typer.Option("--open/--no-open", help="Open the page in a browser.")] = True,
) -> None:
    """Serve a page on which a person drives the arm; needs vgtsim[live]. Ctrl-C ends it.

    Records of what was commanded are left in the folder, each with a scene that `vgtsim run` plays.
    """
    from vgtsim.site import load_site
    from vgtsim.web import Session

    site = load_site(scene_name)
    with Session(site, out or Path("out") / site.task.name, host, port) as session:
        shown = f"[{host}]" if ":" in host else host.replace("0.0.0.0", "127.0.0.1")
        address = f"http://{shown}:{session.port}"
        OUT.print(f"{site.task.name}: {address} (Ctrl-C ends)")
        if record:
            session.loop.tape.begin()
            OUT.print(f"recording: {session.loop.tape.file}", soft_wrap=True)
        if open_page:
            webbrowser.open(address)
        try:
            session.run()
        except KeyboardInterrupt:
            OUT.print("ended")
