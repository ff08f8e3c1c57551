"""The record of a live run: every command since the start, on disk as soon as it is given, with a scene that replays it."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TextIO

from vgtsim.description import MOST_COMMANDS, Operator, OperatorCommand, StartPosture, write_command
from vgtsim.site import Site

_LONGEST = 0.02  # s: of a step, so that one fits into a cycle of 50 Hz


def make_live(site: Site) -> Site:
    """The site that a person drives: an operator's as it is, and of a scene with goals its arm, tank and start.

    Each step is recorded, as it is in operators' scenes.
    """
    task = site.task
    if task.operator is not None:
        return site
    # without goals a start is not searched near the first one: it is given
    motion = {"goals": (), "start": task.motion.start or StartPosture(inputs=tuple(site.start.tolist()))}
    step = site.fit_step(_LONGEST)
    changed = {
        "name": f"{task.name}_live",
        "operator": Operator(),
        "mission": (),
        "motion": task.motion.model_copy(update=motion),
        "simulation": task.simulation.model_copy(update={"timestep": step, "log_rate": 1 / step}),
    }
    return Site(replace(site.scene, task=task.model_copy(update=changed)))


@dataclass
class Tape:
    """Keeps the commands since the start, and writes them to a file while one is open.

    A record is `NAME_K.jsonl` in the folder, K the first number that is free; beside it `NAME_K.toml` is a scene that plays
    it with `vgtsim run`. `file` is that of the record that is being made.
    """

    site: Site
    folder: Path
    file: Path | None = None
    _lines: list[str] = field(default_factory=list)
    _stream: TextIO | None = None

    def note(self, command: OperatorCommand) -> None:
        """Keep a command that was given, and write it at once if a record is being made.

        Raises:
            OSError: The disk does not take it; the record ends there.
        """
        self._lines.append(write_command(command))
        if self._stream is None:
            return
        try:
            self._stream.write(f"{self._lines[-1]}\n")
            self._stream.flush()
        except OSError:
            self.end()
            raise
        if len(self._lines) >= MOST_COMMANDS:
            self.end()

    def begin(self) -> None:
        """Begin a record with all commands since the start; an `OSError` where the folder cannot be written."""
        self.end()
        self.folder.mkdir(parents=True, exist_ok=True)
        name, number = self.site.task.name, 1
        while (file := self.folder / f"{name}_{number}.jsonl").exists():
            number += 1
        scene = self._describe(f"{name}_{number}", file.name)
        file.with_suffix(".toml").write_text(scene, encoding="utf-8")
        self._stream, self.file = file.open("x", encoding="utf-8"), file
        self._stream.writelines(f"{line}\n" for line in self._lines)
        self._stream.flush()

    def end(self) -> None:
        """End the record, if there is one."""
        if self._stream is not None:
            self._stream.close()
        self._stream = self.file = None

    def forget(self) -> None:
        """End the record and forget all commands: the run starts anew."""
        self.end()
        self._lines.clear()

    def _describe(self, name: str, record: str) -> str:
        """A scene over that of the site, as TOML; JSON writes texts and lists as TOML does."""
        site, simulation = self.site, self.site.task.simulation
        lines = [f"base = {json.dumps(str(site.scene.file.resolve()))}", f"name = {json.dumps(name)}"]
        lines += ["mission = []", "", "[operator]", f"record = {json.dumps(record)}", ""]
        lines += ["[simulation]", f"timestep = {simulation.timestep!r}", f"log_rate = {simulation.log_rate!r}", ""]
        lines += ["[motion]", "goals = []"]
        start = site.task.motion.start
        if isinstance(start, StartPosture) and start.inputs is not None:
            lines.append(f"start = {{ inputs = {json.dumps(start.inputs)} }}")
        return "\n".join(lines) + "\n"
