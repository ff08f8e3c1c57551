"""Viser's client in a server of its own, with a word ahead of it to browsers that draw without a graphics card."""

from __future__ import annotations

import logging
from importlib.resources import files
from pathlib import Path
from typing import Any

import viser
from viser import ViserServer, infra

_HEAD = "<head>"
_NOISE = "opening handshake failed"  # viser leaves such records out by this text: browsers open connections that they do not use


def make_client() -> str:
    """The page of viser's client, whose edges are not smoothed where pixels are worked out by a processor.

    Smoothing is two fifths of what such a picture costs. Keys that move a slider or go into a field do not turn the view.
    """
    page = (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text(encoding="utf-8")
    pages = files("vgtsim.web").joinpath("pages")
    words = [pages.joinpath(name).read_text("utf-8") for name in ("software.html", "keys.html")]
    return page.replace(_HEAD, _HEAD + "".join(words), 1)


def open_client(host: str, port: int, label: str, folder: Path) -> ViserServer:
    """A viser server at an address that gives `make_client`, which is written to a folder.

    Viser has no setting for its page, so the folder of the page is changed between the server's making and its start.
    """
    logging.getLogger("websockets.server").addFilter(_say_in_a_line)
    (folder / "index.html").write_text(make_client(), encoding="utf-8")
    start = infra.WebsockServer.start

    def start_here(server: Any) -> None:
        server._http_server_root = folder
        start(server)

    infra.WebsockServer.start = start_here  # pyright: ignore[reportAttributeAccessIssue]
    try:
        return ViserServer(host, port, label=label, verbose=False)
    finally:
        infra.WebsockServer.start = start


def _say_in_a_line(record: logging.LogRecord) -> bool:
    """Leave the traceback out of a record: what a browser sends and nobody can read is no defect."""
    error, record.exc_info = record.exc_info and record.exc_info[1], None
    if error is not None and record.getMessage() != _NOISE:
        record.msg, record.args = f"{record.getMessage()}: {' '.join(str(error).split())}", ()
    return True
