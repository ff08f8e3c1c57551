"""An operator as a client of the plant: commands at their times go through the controller, step by step."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from vgtsim.control import Controller, apply
from vgtsim.description import OperatorCommand
from vgtsim.log import Piece
from vgtsim.plant.plant import Plant
from vgtsim.site import Site

Tick = Callable[[float], None]  # called with the simulated time, s, after each step

_AT_ONCE = 1e-6  # of a step: a command of that instant counts


class Operation:
    """A plant with its controller, from the scene's start: command the controller and `advance`, step by step.

    Played from a record or by a live hand, the same commands at the same steps give the same log. A `store` is given the log
    piece by piece, see `Plant`.
    """

    def __init__(self, site: Site, store: Callable[[Piece], None] | None = None) -> None:
        self.plant = Plant(site, store=store)
        self.controller = Controller(site, self.plant.timestep)
        self.controller.start(self.plant.reset().commanded, site.start)

    def advance(self) -> None:
        """One step of controller and plant; errors are those of `Plant.step`."""
        self.plant.mark(-1, target=self.controller.target)
        self.plant.command(self.controller.step(self.plant.state))
        self.plant.step()


def play_commands(operation: Operation, commands: Sequence[OperatorCommand], tick: Tick) -> None:
    """Give commands at their times; after the last one the arm comes to rest and is held as at a goal."""
    plant, motion = operation.plant, operation.plant.site.task.motion
    waiting, step = list(commands)[::-1], plant.timestep
    hold, patience = (round(seconds / step) for seconds in (motion.hold, motion.patience))

    def advance() -> None:
        while waiting and waiting[-1].time <= plant.time + _AT_ONCE * step:
            apply(operation.controller, waiting.pop())
        operation.advance()
        tick(plant.time)

    while waiting:
        advance()
    advance()  # the last command has been given
    for _ in range(patience):
        if plant.calm:
            for _ in range(hold):
                plant.mark(-1, settled=True, target=operation.controller.target)
                plant.command(plant.state.commanded)
                plant.step()
                tick(plant.time)
            break
        advance()
