"""The process of the page: a viser server that shows the states of a live arm and posts what a person does.

Its client has a word ahead of it to browsers that draw without a graphics card.
"""

from __future__ import annotations

import contextlib
import io
import logging
import signal
import sys
import tempfile
import threading
import time
from importlib.resources import files
from math import nan
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import viser
from viser import ViserServer, infra

from vgtsim.description import Scene
from vgtsim.ending import end_at_once
from vgtsim.output.colours import scale_end
from vgtsim.site import Site
from vgtsim.statics import solve_members
from vgtsim.web.controls import Controls
from vgtsim.web.display import Display, Sight
from vgtsim.web.letters import Letter, LiveState, Pages, Served, Shown
from vgtsim.web.precedence import SERVER, take_precedence

_SCALE = 1.25  # of the greatest force at the start, where the colours end
# s that a thread may keep others waiting: those that write to pages and the one that shows states take turns
_TURN = 1e-3
_REACH = 3.0  # m within which the nearest thing is looked for
_HEAD = "<head>"
_NOISE = "opening handshake failed"  # viser leaves such records out by this text: browsers open connections that they do not use


def serve(pipe: Connection[Any, Any], scene: Scene, host: str, port: int, *, precedence: bool = True) -> None:
    """Serve a page until the other end of the pipe is closed, ahead of other programs if that is asked for and permitted."""
    end_at_once()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C ends the loop, which closes the pipe
    sys.setswitchinterval(_TURN)
    with contextlib.redirect_stdout(io.StringIO()), tempfile.TemporaryDirectory() as folder:  # viser speaks
        page = Page(pipe, Site(scene), open_client(host, port, f"vgtsim: {scene.task.name}", Path(folder)))
        first = take_precedence(SERVER, threading.enumerate()) if precedence else contextlib.nullcontext()
        with first, contextlib.suppress(EOFError, OSError):
            while True:
                page.show(pipe.recv())
        page.server.stop()


class Page:
    """Display and controls in one server, at the page's end of the pipe."""

    def __init__(self, pipe: Connection[Any, Any], site: Site, server: ViserServer) -> None:
        """Fill a server and say that it serves."""
        self._pipe, self._site, self._lock, self._delay = pipe, site, threading.Lock(), nan
        self._answered = False  # whether the last state followed a command
        self.server = server
        end = scale_end(_SCALE * solve_members(site.load_model, site.chain.nodes(site.start)).near_axial)
        with self.server.atomic():
            self._display = Display(self.server, site, end)
            self._controls = Controls(self.server, site, end, self.post)
        there = site.surroundings.unloaded
        there.find_nearest(there.points(site.start[None])[0], _REACH)  # compiles it
        self.server.on_client_connect(lambda _: self._count())
        self.server.on_client_disconnect(lambda _: self._count())
        self.post(Served(self.server.get_port()))
        self._count()

    def post(self, letter: Letter) -> None:
        """Post a letter, from any thread; after the loop has ended nobody reads it."""
        with self._lock, contextlib.suppress(OSError):
            self._pipe.send(letter)

    def show(self, state: LiveState) -> None:
        """Show a state; before that the next one is asked for, which waits in the pipe meanwhile."""
        self.post(Shown(self._delay if self._answered else nan, time.process_time()))
        near = self._site.surroundings.unloaded.find_nearest(state.points, _REACH)
        words = f"{near.gap:.3f} m, {near.bodies}" if near else f"more than {_REACH:g} m"
        sight = Sight(nodes=state.nodes, axial=state.axial, target=state.target, gap=near)
        with self.server.atomic():  # one message, for which the thread that writes is woken once
            self._display.show(sight)
            self._controls.show(state, words, self._delay)
        self.server.flush()
        self._answered = bool(state.arrived)
        if self._answered:
            self._delay = time.monotonic() - state.arrived

    def _count(self) -> None:
        self.post(Pages(len(self.server.get_clients())))


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
