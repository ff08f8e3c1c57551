"""What an operator commands: how commands become motion, and the record of them, one JSON object a line."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationError, model_validator

from vgtsim.description.figures import Acceleration, Speed, Time, Wait
from vgtsim.description.schema import Description, say_allowed
from vgtsim.description.toml_file import read_text
from vgtsim.digests import digest
from vgtsim.errors import DescriptionError

Row = tuple[float, ...]
Six = tuple[float, float, float, float, float, float]
Target = Literal["twist", "goal", "inputs", "lengths", "hold"]

TARGETS: tuple[Target, ...] = ("twist", "goal", "inputs", "lengths", "hold")
MOST_COMMANDS = 1_000_000  # commands: five hours at 50 a second
_MOST_BYTES = 200 * MOST_COMMANDS  # of a record: a command has a hundred


class Operator(Description):
    """How the commands of an operator become motion; a radian of the tool counts as a metre.

    Attributes:
        record: File of commands that a run plays, relative to the scene's file; absent for an arm that is driven live.
        speed: Greatest speed of the tool's target.
        acceleration: Greatest acceleration of the tool's target.
        filter: Time constant of each of the two first-order filters that the target passes.
    """

    record: str | None = None
    speed: Speed = 0.25
    acceleration: Acceleration = Field(default=0.1, gt=0)
    filter: Wait = 0.3


class OperatorCommand(Description):
    """One command: from a time on, one target. Figures are SI, vectors in frame G.

    Attributes:
        time: Since the start of the run.
        twist: Velocity of the tool point, m/s, and angular velocity of the tip plate, rad/s.
        goal: Tool point, m, and direction of the tool.
        method: For a goal: `rate`, the tool goes there straight; `newton`, the posture is solved and the cylinders go there.
        inputs: Inputs of the active modules.
        lengths: Lengths of the cylinders, m.
        hold: The arm comes to rest.
        objective: What the null space is used for from now on, terms as in `motion.objective`; an empty list for nothing.
    """

    time: Annotated[Time, Field(ge=0)]
    twist: Six | None = None
    goal: Six | None = None
    method: Literal["rate", "newton"] = "rate"
    inputs: Row | None = None
    lengths: Row | None = None
    hold: Literal[True] | None = None
    objective: tuple[str, ...] | None = None

    @model_validator(mode="after")
    def _has_one_target(self) -> OperatorCommand:
        given = [name for name in TARGETS if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"one of {', '.join(TARGETS)}, not {' and '.join(given) or 'none'}")
        return self

    @property
    def target(self) -> Target:
        """Which target it has."""
        return next(name for name in TARGETS if getattr(self, name) is not None)


def load_commands(file: Path) -> tuple[OperatorCommand, ...]:
    """Read a record of commands, one JSON object a line, in the order of their times.

    Raises:
        DescriptionError: The file is missing, a line is no command, or the times fall.
    """
    lines = read_text(file, _MOST_BYTES, "record of commands, one JSON object a line").splitlines()
    if len(lines) > MOST_COMMANDS:
        raise DescriptionError(file, "", f"{len(lines)} lines", f"at most {MOST_COMMANDS}")
    commands: list[OperatorCommand] = []
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            commands.append(OperatorCommand.model_validate_json(line))
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            key = ".".join([f"line {number}", *map(str, first["loc"])])
            found = line if len(line) <= 60 else f"{line[:57]}..."
            raise DescriptionError(file, key, found, say_allowed(first)) from None
        if len(commands) > 1 and commands[-1].time < commands[-2].time:
            found = f"{commands[-1].time:g} s after {commands[-2].time:g} s"
            raise DescriptionError(file, f"line {number}.time", found, "times that do not fall")
    if not commands:
        raise DescriptionError(file, "", "no command", "at least one")
    return tuple(commands)


def digest_commands(commands: Sequence[OperatorCommand]) -> str:
    """Digest of a record."""
    return digest(*(f"{write_command(command)}\n".encode() for command in commands))


def write_command(command: OperatorCommand) -> str:
    """The line of a record that `load_commands` reads back, bit for bit."""
    return command.model_dump_json(exclude_none=True, exclude_defaults=True)
