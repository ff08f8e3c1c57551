from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

from vgtsim.cli import app
from vgtsim.description import load_tool_path
from vgtsim.output.figure import save_figure

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[1]
ROUNDING = 2e-9  # of figures with nine decimals, m


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("track")
    path = place / "short.toml"
    path.write_text(
        'name = "short"\nstart = [6, -1, -5.8]\ndirection = [0.3, 0, -1]\n[[pieces]]\nshape = "line"\nto = [6, -0.8, -5.8]\n'
    )
    model = ROOT / "models/arm15/arm15.toml"
    done = CliRunner().invoke(app, ["track", str(model), "--path", str(path), "--out", str(place)])
    assert done.exit_code == 0, done.output
    return place


def test_table_holds_the_reported_figures(folder):
    with (folder / "short.csv").open() as file:
        heads, *rows = csv.reader(file)
    assert heads[:4] == ["time, s", "x, m", "y, m", "z, m"]
    assert len(heads) == 7 + 15 + 1
    table = np.array([row[:-1] for row in rows], float)
    facts = json.loads((folder / "short.json").read_text())
    assert facts["duration, s"] == pytest.approx(table[-1, 0])
    np.testing.assert_allclose(table[[0, -1], 1:4], [[6, -1, -5.8], [6, -0.8, -5.8]], atol=ROUNDING)
    motion = np.diff(table[:, 7:], axis=0)
    bends = np.abs(np.diff(motion, axis=0)).max() / table[1, 0] ** 2
    assert bends == pytest.approx(facts["greatest acceleration, m/s^2"], abs=4 * ROUNDING / table[1, 0] ** 2)
    assert facts["greatest deviation of the tool, m"] < 1e-4


def test_drawing_shows_all_three_quantities(folder):
    text = (folder / "short.svg").read_text()
    assert text.count('id="axes_') == 3


def test_same_drawing_is_the_same_file_and_appears_whole(folder, tmp_path):
    """No date, no identifiers drawn anew; what cannot be written leaves the old file."""
    assert "<dc:date>" not in (folder / "short.svg").read_text()
    for name in ("one.svg", "two.svg"):
        figure = Figure()
        figure.add_subplot().plot([0, 1], [0, 1], clip_on=True, marker="x")
        save_figure(figure, tmp_path / name)
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["one.svg", "two.svg"]


def test_shipped_path_reads():
    path = load_tool_path(ROOT / "scenes/paths/waste_raster.toml")
    assert [piece.shape for piece in path.pieces] == ["spline", "raster", "arc"]
