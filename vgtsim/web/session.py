"""A live session: the loop in this process, the page in one of its own, until the loop is interrupted."""

from __future__ import annotations

import multiprocessing
import socket
import time
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

from vgtsim.errors import PageError
from vgtsim.planning import check_site
from vgtsim.site import Site
from vgtsim.web.letters import Line, Served
from vgtsim.web.loop import LiveLoop, prepare
from vgtsim.web.precedence import LOOP, take_precedence
from vgtsim.web.serving import serve
from vgtsim.web.tape import Tape, make_live

_PATIENCE = 600.0  # s for a server to begin: on a busy machine kernels are compiled first, for minutes
_FAREWELL = 5.0  # s for it to end


class Session:
    """A live arm with its page; a context, at whose end the record is whole and the server has ended.

    `loop` is the live loop, to be `run`, and `port` that of the page.
    """

    def __init__(
        self, site: Site, folder: Path, host: str = "127.0.0.1", port: int = 8080, *, precedence: bool = True
    ) -> None:
        """Begin both; records go to a folder. Port 0 is any that is free. See `take_precedence`, while the loop runs.

        Raises:
            PageError: The port is in use, or the server does not begin.
            DescriptionError: The scene cannot work.
        """
        live = make_live(site)
        check_site(live)
        require_port(host, port)
        context = multiprocessing.get_context("spawn")  # threads and graphics do not survive a fork
        pipe, far = context.Pipe()
        self._server = context.Process(
            target=serve, args=(far, live.scene, host, port), kwargs={"precedence": precedence}, daemon=True
        )
        self._server.start()
        far.close()
        self._pipe, line, self._precedence = pipe, Line(pipe), precedence
        try:
            prepare(live)
            self.loop = LiveLoop(live, line, Tape(live, folder))
            self.port = self._await_server(line, host, port)
        except BaseException:
            self.close()
            raise

    def _await_server(self, line: Line, host: str, port: int) -> int:
        until = time.monotonic() + _PATIENCE
        while time.monotonic() < until:
            for letter in line.receive():
                if isinstance(letter, Served):
                    if port not in (0, letter.port):
                        raise PageError(f"{host}:{port}", "the port is in use; choose another one")
                    return letter.port
            time.sleep(0.05)
        raise PageError(f"{host}:{port}", f"the server has not begun within {_PATIENCE:g} s")

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Run the loop. Errors are those of `LiveLoop.run`."""
        with take_precedence(LOOP) if self._precedence else nullcontext():
            self.loop.run(until)

    def close(self) -> None:
        """End the record and the server."""
        if hasattr(self, "loop"):
            self.loop.end_record()
        self._pipe.close()
        self._server.join(_FAREWELL)
        if self._server.is_alive():
            self._server.terminate()
            self._server.join()

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def require_port(host: str, port: int) -> None:
    """Refuse a port that is in use; viser would take the next one.

    Raises:
        PageError: It is in use, or the address is not of this machine.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # what has just ended does not count
            probe.bind(address)
    except (OSError, OverflowError) as error:
        raise PageError(
            f"{host}:{port}", f"{getattr(error, 'strerror', None) or error}; choose another --port"
        ) from None
