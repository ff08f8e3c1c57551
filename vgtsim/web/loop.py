"""The live loop: a plant with its controller by the clock, 50 cycles a second, commanded by the letters of a page."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np

from vgtsim.commands import read_row
from vgtsim.description import TARGETS, OperatorCommand
from vgtsim.errors import CommandError, StoppedError, VgtError
from vgtsim.log import Piece
from vgtsim.plant import Operation
from vgtsim.site import Site
from vgtsim.web.letters import Button, Letter, Line, LiveState, Pages, Shown, Wish
from vgtsim.web.tape import Tape

PERIOD = 0.02  # s, of a cycle
_BEHIND = 0.2  # s by which the loop may be late and catch up; what is more is lost, and the arm is so much later
_SEEN = 100  # cycles over which their rate is told
_EVERY = 2  # cycles between states while nobody commands: 25 pictures a second, as in a film, at half the page's work


class LiveLoop:
    """Drives a site's arm as the letters say, and sends its state where something changed.

    A letter does not wait for the clock: its cycle comes at once, the next ones at their times, so that simulated time is
    at most one cycle ahead. After a letter the state is sent with the same cycle, otherwise with every second one. The run
    goes on while it is played and a page is open. The site is one of `make_live`.

    Attributes:
        operation: Plant and controller.
        shown: What the server told of the last states: delays and processor time.
        count: Cycles in which time went on, since the loop was made.
    """

    def __init__(
        self,
        site: Site,
        line: Line,
        tape: Tape,
        *,
        store: Callable[[Piece], None] | None = None,
        clock: Callable[[], float] = time.monotonic,
        wait: Callable[[float], object] | None = None,
        every: int = _EVERY,
    ) -> None:
        """Stand at the start; a `store` is given the log, which is dropped without one, see `Plant`.

        A state is sent `every` so many cycles, and after a letter at once. To `wait` is to let some time go by, s, or less if a
        letter comes, which is then told.
        """
        self.site, self.line, self.tape = site, line, tape
        self._store, self._clock, self._wait = store or _drop, clock, wait or line.wait
        self._letters: list[Letter] = []  # that came between two cycles
        self.shown: deque[Shown] = deque(maxlen=1000)
        self._every, self._waited, self._asked = every, 0, False
        self.pages = self.count = 0
        self.playing, self.said = True, ""
        self._limits = {"twist": 6, "goal": 6, "inputs": site.chain.straight.size, "lengths": len(site.truss.actuated)}
        self._begin()

    def _begin(self) -> None:
        self.operation = Operation(self.site, self._store)
        self.steps = max(round(PERIOD / self.operation.plant.timestep), 1)
        self.ended, self._arrived, self._changed, self._late = "", 0.0, True, False
        self._cycles: deque[float] = deque(maxlen=_SEEN)

    @property
    def period(self) -> float:
        """Of a cycle, s."""
        return self.steps * self.operation.plant.timestep

    @property
    def running(self) -> bool:
        """Whether time goes on."""
        return self.playing and self.pages > 0 and not self.ended

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Go on by the clock until something says so. Errors are those of `Line.receive`."""
        due = self._clock()
        while not until():
            self.cycle()
            due = max(due + self.period, self._clock() - _BEHIND)
            self._rest(due)

    def _rest(self, due: float) -> None:
        """Let time go by until the next cycle, or up to a period less where a person asks for something.

        A state that the page was not ready for is sent as soon as it is.
        """
        early = 0.0
        while (left := due - early - self._clock()) > 0:
            if self._wait(left):
                self._letters = self.line.receive(self._letters)
                if any(not isinstance(letter, Shown) for letter in self._letters):
                    early = self.period
                elif self._late and self.line.ready:
                    self._send()

    def cycle(self) -> None:
        """Read the letters, go on by one cycle if the run does, and send the state."""
        letters, self._letters = self.line.receive(self._letters), []
        for letter in letters:
            self.take(letter)
        if self.running:
            self._cycles.append(self._clock())
            self.count += 1
            self._advance()
        else:
            self._cycles.clear()
        self._waited += 1
        self._late = self._changed and (self._asked or self._waited >= self._every)
        if self._late and self.line.ready:
            self._send()

    def _send(self) -> None:
        self.line.send(self.tell())
        self._changed, self._asked, self._late, self._waited, self._arrived = False, False, False, 0, 0.0

    def _advance(self) -> None:
        self._changed = True
        try:
            for _ in range(self.steps):
                self.operation.advance()
                if self.operation.plant.stopped:
                    break
        except VgtError as error:  # it diverged, or stands in a singular posture
            self.ended = str(error)
        self.ended = self.ended or self.operation.plant.stopped

    def take(self, letter: Letter) -> None:
        """Do what a letter says; what cannot be done is said, and changes nothing."""
        self._asked = self._asked or not isinstance(letter, Shown)
        self._changed = self._changed or self._asked
        try:
            match letter:
                case Wish():
                    self._arrived = letter.arrived
                    self.said = ""
                    self.command(letter)
                case Button.PLAY | Button.PAUSE:
                    self.playing = letter is Button.PLAY
                case Button.RECORD:
                    self.tape.begin()
                    self.said = ""
                case Button.END_RECORD:
                    self.end_record()
                case Button.ANEW:
                    self.end_record()
                    self.tape.forget()
                    self._begin()
                case Pages(count):
                    self.pages = count
                case Shown():
                    self.shown.append(letter)
        except (VgtError, OSError) as error:
            self.said = str(error)

    def command(self, wish: Wish) -> None:
        """Give the controller a command and keep it; one that is refused is not kept.

        Raises:
            VgtError: It is refused, see `Controller.command`, or the run has ended.
            OSError: The record cannot be written.
        """
        if self.ended:
            raise StoppedError(self.ended)
        if wish.target not in TARGETS:
            raise CommandError("command", repr(wish.target), f"one of {', '.join(TARGETS)}")
        given: dict[str, Any] = {"hold": True}
        if wish.target != "hold":
            row = read_row(wish.target, wish.value, self._limits[wish.target])  # pyright: ignore[reportArgumentType]
            given = {wish.target: tuple(row.tolist())}
        objective = None if wish.objective is None else tuple(wish.objective)
        self.operation.controller.command(**given, objective=objective)
        now = self.operation.plant.time
        self.tape.note(OperatorCommand.model_validate({"time": now, **given, "objective": objective}))

    def end_record(self) -> None:
        """End the record, if one is made, with the arm coming to rest, as it does when the record is played.

        Errors are those of `command`.
        """
        if self.tape.file is None:
            return
        try:
            if not self.ended:
                self.command(Wish(target="hold", value=True))
        finally:
            self.said = f"recorded: {self.tape.file}" if self.tape.file else self.said
            self.tape.end()

    def tell(self) -> LiveState:
        """The state for a page."""
        plant, controller = self.operation.plant, self.operation.controller
        state = plant.state
        try:
            known = controller.report
        except StoppedError:  # no step has been made
            known = None
        span = self._cycles[-1] - self._cycles[0] if self._cycles else 0.0
        return LiveState(
            time=plant.time,
            rate=(len(self._cycles) - 1) / span if span else np.nan,
            nodes=np.array(state.nodes),
            tool=state.tool_position,
            axial=plant.axial,
            lengths=np.array(state.commanded),
            target=controller.target,
            condition=known.condition if known else np.nan,
            utilisation=known.utilisation if known else np.nan,
            member=known.member if known else "",
            held_by=known.held_by if known else (),
            playing=self.playing,
            record=str(self.tape.file or ""),
            ended=self.ended,
            said=self.said,
            arrived=self._arrived,
        )


def prepare(site: Site) -> None:
    """Go through each kind of command once, so that all that a live loop needs is compiled before a person comes."""
    operation = Operation(site, _drop)
    controller = operation.controller
    for _ in range(2):
        operation.advance()
        controller.command(lengths=operation.plant.state.commanded)
        operation.advance()
        controller.command(goal=controller.target)
        operation.advance()
        controller.command(twist=[0.01] * 6)
        operation.advance()
        controller.command(hold=True)


def _drop(_: Piece) -> None:
    """Keep no log: the record of commands makes it again."""
