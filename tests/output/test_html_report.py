"""The report for people: whole, alone, and the same every time."""

import base64
import dataclasses
import io
import re
from html.parser import HTMLParser

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from vgtsim.output.html_report import describe_run, write_page
from vgtsim.output.quantities import format_quantity
from vgtsim.verification import CHECK_NAMES, JudgedRun

pytestmark = pytest.mark.long

GREATEST_SIZE = 3e6  # bytes; a mail server takes it
PLOTS = 10
VOID = {"meta", "wbr"}
LOSSY = 12  # levels of 256 by which film and JPEG may change a grey


class Outline(HTMLParser):
    """Collects what the tests ask for, and the tags still open at the end."""

    def __init__(self):
        super().__init__()
        self.open, self.links, self.ids, self.text, self.figures = [], [], [], [], 0

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.links += [value for name, value in attrs if name in ("src", "href", "xlink:href")]
        self.ids += [values["id"]] if "id" in values else []
        self.figures += tag == "figure"
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture(scope="module")
def page(judged, tmp_path_factory):
    path = tmp_path_factory.mktemp("html") / "report.html"
    write_page(describe_run(judged), path)
    return path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def outline(page):
    parser = Outline()
    parser.feed(page)
    return parser


def test_nothing_is_fetched(page, outline):
    assert "http" not in page
    assert "@import" not in page
    assert all(link.startswith(("#", "data:")) for link in outline.links)


def test_results_beside_the_page_are_linked_and_the_film_is_shown(judged, no_plots, tmp_path):
    (tmp_path / "report.json").write_text("{}")
    film = imageio_ffmpeg.write_frames(tmp_path / "video.mp4", (64, 64), macro_block_size=1)
    film.send(None)
    film.send(np.full((64, 64, 3), 90, np.uint8))
    film.close()
    write_page(describe_run(judged), tmp_path / "report.html")
    parser = Outline()
    parser.feed((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert {"report.json", "video.mp4"} == {link for link in parser.links if not link.startswith(("#", "data:"))}
    (poster,) = re.findall(r'poster="data:image/jpeg;base64,([^"]*)"', (tmp_path / "report.html").read_text())
    still = np.asarray(Image.open(io.BytesIO(base64.b64decode(poster))))
    assert still.shape == (64, 64, 3)
    assert np.abs(still.astype(int) - 90).max() < LOSSY


def test_markup_is_whole(outline):
    assert outline.open == []
    assert len(outline.ids) == len(set(outline.ids))
    assert {link[1:] for link in outline.links if link.startswith("#")} <= set(outline.ids)
    assert outline.figures == PLOTS


def test_verdict_comes_first_and_every_check_is_named(page, outline, report):
    text = " ".join(outline.text)
    body = page[page.index("<body>") :]
    assert body.index("PASSED") < body.index("<svg") < body.index("<table")
    assert all(name.replace("_", " ") in text for name in CHECK_NAMES)
    for check in report.checks:
        assert f"≤ {format_quantity(check.limit, check.unit)}" in text or check.sense == "at least"


def test_user_text_is_escaped(page, site):
    assert "<sanity>" in site.task.title
    assert "<sanity>" not in page
    assert "&lt;sanity&gt;" in page


def test_it_can_be_mailed(page):
    assert len(page.encode()) < GREATEST_SIZE


def test_the_same_run_gives_the_same_file(judged, page, tmp_path):
    write_page(describe_run(judged), tmp_path / "again.html")
    assert (tmp_path / "again.html").read_text(encoding="utf-8") == page


def test_failed_and_missing_checks_stand_out(site, log, report, no_plots, tmp_path):
    worse = dataclasses.replace(report.checks[0], measured=1.0, detail="a loose pin")
    checks = (worse, *(check for check in report.checks[1:] if check.name != "clearance"))
    failed = dataclasses.replace(report, checks=checks, series={})
    write_page(describe_run(JudgedRun(site, log, failed)), tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "FAILED" in text
    assert "PASSED" not in text
    assert "a loose pin" in text
    assert len(re.findall(r'<tr class="fail">', text)) == 1
    assert re.search(r"clearance</strong>.{0,60}not made", text)
    opened = re.findall(r'<details class="fail" open>\s*<summary><span class="mark">✗</span><strong>([^<]*)', text)
    assert opened == [worse.name.replace("_", " "), "clearance"]


def test_plots_without_figures_say_so(site, log, report, tmp_path):
    nothing = np.full(len(log.time), np.nan)
    bare = dataclasses.replace(report, series={"closure": nothing})
    write_page(describe_run(JudgedRun(site, log, bare)), tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    for name in ("closure", "tool_position_error", "utilisation", "clearance"):
        assert re.search(rf"Not measured: [^<]*{name}", text)
    assert text.count("<svg") == PLOTS - 4


def test_a_run_that_ended_early_is_reported(site, log, report, tmp_path):
    cut = {
        field.name: getattr(log, field.name)[:3]
        for field in dataclasses.fields(log)
        if field.name in ("time", "nodes", "ends", "commanded", "actual", "rates", "member_force", "member_moment")
        or field.name in ("actuator_force", "mast_reaction", "tool_position", "tool_direction", "goal", "settled")
    }
    pair = np.array([["m5/longeron/1", "tank/saltwell_screen"]])
    short = dataclasses.replace(
        log,
        **cut,
        contact_time=np.array([0.1]),
        contact_pair=pair,
        contact_distance=np.array([-1e-3]),
        warnings=("BADQACC",),
        stopped="diverged at t = 0.5 s",
    )
    bare = dataclasses.replace(report, series={})
    write_page(describe_run(JudgedRun(site, short, bare)), tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "diverged at t = 0.5 s" in text
    assert "BADQACC" in text
    assert "m5/longeron/1 with tank/saltwell_screen" in text
    assert text.count("never settled") == len(site.task.motion.goals)
