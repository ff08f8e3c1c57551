"""A path as it is run: lengths over time as CSV, its figures as JSON, and a drawing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from vgtsim.kinematics import Chain
from vgtsim.output.figure import draw_limit, save_figure
from vgtsim.planning import Followed
from vgtsim.replacing import replacing

Facts = dict[str, str | float | int]


def write_track(chain: Chain, followed: Followed, facts: Facts, stem: Path) -> tuple[Path, ...]:
    """Write a path as it is run: .csv, the facts as .json, and .svg; the stem is the files' path without suffix."""
    files = tuple(stem.with_suffix(suffix) for suffix in (".csv", ".json", ".svg"))
    _write_table(chain, followed, files[0])
    with replacing(files[1]) as whole:
        whole.write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")
    save_figure(_draw(followed), files[2])
    return files


def _write_table(chain: Chain, followed: Followed, file: Path) -> None:
    tool, direction = chain.tool(followed.q)
    names = [f"{module.name}/actuator/{i + 1}, m" for module in chain.manipulator.active for i in range(3)]
    heads = ["time, s", "x, m", "y, m", "z, m", "direction x", "direction y", "direction z", *names, "piece"]
    rows = np.column_stack([followed.time, tool, direction, followed.lengths])
    with replacing(file) as whole, whole.open("w", encoding="utf-8") as out:
        out.write(",".join(f'"{head}"' for head in heads) + "\n")
        for row, stretch in zip(rows, followed.stretch, strict=True):
            out.write(",".join(f"{value:.9f}" for value in row) + f',"{followed.names[stretch]}"\n')


def _draw(followed: Followed) -> Figure:
    """Lengths, rates and accelerations of all actuators over time."""
    figure = Figure(figsize=(9.6, 7.2), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True)
    limits = followed.limits
    axes[0].plot(followed.time, followed.lengths, linewidth=0.8)
    axes[0].set_ylabel("length, m")
    axes[1].plot(followed.time[1:], followed.rates / limits.rate, linewidth=0.8)
    axes[1].set_ylabel("rate over its limit")
    axes[2].plot(followed.time[1:-1], followed.accelerations, linewidth=0.8)
    axes[2].set_ylabel("acceleration, m/s²")
    for low, high, place in ((-1.0, 1.0, axes[1]), (-limits.acceleration, limits.acceleration, axes[2])):
        draw_limit(place, high, "limit")
        draw_limit(place, low, "limit")
    for change in followed.time[np.flatnonzero(np.diff(followed.stretch))]:
        for place in axes:
            place.axvline(change, color="0.7", linewidth=0.6)
    axes[2].set_xlabel("time, s")
    return figure
