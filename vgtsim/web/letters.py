"""What passes between a live arm and its page, which are two processes; and the line between them, which holds nobody up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.errors import PageError

_AT_ONCE = 200  # letters that are taken in one cycle: more is a page that floods


class Button(Enum):
    """What a person asks of the run."""

    PLAY = "play"
    PAUSE = "pause"
    RECORD = "record"
    END_RECORD = "end of the record"
    ANEW = "start anew"


@dataclass(frozen=True, kw_only=True)
class Wish:
    """A command of a page, see `Controller.command`; goals are gone to by rates, as solving a posture may take seconds.

    `arrived` is the monotonic time at which the server had it, s.
    """

    target: str
    value: ArrayLike | bool
    objective: Sequence[str] | None = None
    arrived: float = 0.0


@dataclass(frozen=True)
class Pages:
    """How many pages are open."""

    count: int


@dataclass(frozen=True)
class Served:
    """The server is there, at a port."""

    port: int


@dataclass(frozen=True)
class Shown:
    """A state is being shown, and the next one may come.

    Of the state before, `delay` is the time from the arrival of the newest command that it follows until it was sent to
    the pages, s, NaN where there was none; `spent` is the processor time of the server until now, s.
    """

    delay: float
    spent: float


Letter = Wish | Button | Pages | Served | Shown


@dataclass(frozen=True, kw_only=True, eq=False)
class LiveState:
    """What a page shows of a live arm. Vectors are in frame G.

    Attributes:
        time: Simulated time since the start, s.
        rate: Cycles a second that were kept over the last ones.
        nodes: Places of the nodes, shape (N, 3), m, and `tool` that of the tool point, shape (3,), m.
        axial: Axial force of each member, tension positive, shape (M,), N.
        lengths: Wanted lengths of the cylinders, shape (J,), m.
        target: Where the tool is meant to be: position, m, and direction, shape (6,).
        condition, utilisation, member, held_by: As in `ControlReport`.
        playing: Whether the run goes on, or would with a page open.
        record: File of the record that is being made, or an empty string.
        ended: Why the run cannot go on, or an empty string.
        said: What is to be said to the person, such as why a command was refused.
        arrived: Of the newest command that the state follows; 0 for none since the last state.
    """

    time: float
    rate: float
    nodes: Array
    tool: Array
    axial: Array
    lengths: Array
    target: Array
    condition: float
    utilisation: float
    member: str
    held_by: tuple[str, ...]
    playing: bool
    record: str
    ended: str
    said: str
    arrived: float

    @property
    def points(self) -> Array:
        """Nodes and then the tool point, shape (N + 1, 3), m."""
        return np.concatenate([self.nodes, self.tool[None]])


@dataclass
class Line:
    """The arm's end of the line to the page.

    A state is sent only after the page has taken the one before, so at most one is under way and sending never waits,
    however slow the page is.
    """

    pipe: Connection[Any, Any]
    ready: bool = False

    def wait(self, seconds: float) -> bool:
        """Wait for a letter, and tell whether there is one. Errors are those of `receive`."""
        try:
            return self.pipe.poll(seconds)
        except OSError:
            raise PageError("page", "its server has ended") from None

    def receive(self, before: Sequence[Letter] = ()) -> list[Letter]:
        """The letters that have come after those before, of wishes for one thing in a row only the last.

        Raises:
            PageError: The server has ended.
        """
        found = list(before)
        try:
            for _ in range(_AT_ONCE):
                if not self.pipe.poll():
                    break
                letter = self.pipe.recv()
                self.ready = self.ready or isinstance(letter, Served | Shown)
                if found and isinstance(letter, Wish) and _replaces(letter, found[-1]):
                    found.pop()
                found.append(letter)
        except (EOFError, OSError):
            raise PageError("page", "its server has ended") from None
        return found

    def send(self, state: LiveState) -> None:
        """Send a state, unless the page still shows the one before. Errors are those of `receive`."""
        if not self.ready:
            return
        try:
            self.pipe.send(state)
        except OSError:
            raise PageError("page", "its server has ended") from None
        self.ready = False


def _replaces(wish: Wish, last: Letter) -> bool:
    return isinstance(last, Wish) and last.target == wish.target and last.objective in (None, wish.objective)
