"""The recorded page in a browser: it opens from disk, plays, follows its slider, and draws the arm where it should be."""

from __future__ import annotations

import io
import json
import re

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("viser")

from vgtsim.web import write_recording

pytestmark = pytest.mark.long

SIZE = (900, 560)  # pixels; the table at the right covers the last third
SEEN = 580  # pixels of a row that nothing covers
PATIENCE = 120_000  # ms: pictures are drawn by software, on a machine that may be busy
FRAMES = 40  # of the page; few, so that it is ready soon
EARLY, LATE = 0.2, 0.85  # places on the slider
CLOSE = 0.005  # of the slider's length, to which a press is true
NOW = "Number(document.querySelector('[role=slider]').getAttribute('aria-valuenow'))"  # of the slider, s
TRIES = 5  # rounds of three pictures
DRAWN = 6  # pictures that the browser draws between two looks
STEP = 24  # of a colour to 255, from which on a pixel counts as changed
BESIDE = 24  # pixels: names and lines beside the arm


@pytest.fixture(scope="module")
def file(site, log, report, tmp_path_factory):
    few = log.read(0, log.count, log.count // FRAMES)
    path = tmp_path_factory.mktemp("page") / "replay.html"
    write_recording(site, few, report, path)
    return path


@pytest.fixture(scope="module")
def page(browser, file):
    opened = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
    opened.set_default_timeout(PATIENCE)
    opened.wanted, opened.wrong = [], []
    opened.on("request", lambda request: opened.wanted.append(request.url))
    opened.on("pageerror", lambda error: opened.wrong.append(str(error)))
    opened.goto(f"{file.as_uri()}?fixedDpr=1")
    opened.wait_for_selector("#run[data-frame]")
    yield opened
    opened.close()


def find_frame(page):
    return int(page.locator("#run").get_attribute("data-frame"))


def find_time(page):
    return float(page.locator("[role=slider]").get_attribute("aria-valuenow"))


def go(page, drawn, part):
    """Press the slider at a part of its length, which pauses the player; the picture then, and its frame."""
    box = page.locator("[role=slider][aria-valuemax]").locator("xpath=../..").bounding_box()
    page.mouse.click(box["x"] + part * box["width"], box["y"] + box["height"] / 2)
    end = float(page.locator("[role=slider]").get_attribute("aria-valuemax"))
    page.wait_for_function(f"Math.abs({NOW} - {part * end}) < {CLOSE * end}")
    picture = take(page, drawn)
    return picture, find_frame(page)


def take(page, drawn):
    """The picture once it is still, shape (height, width, 3)."""
    before = None
    for _ in range(30):
        page.evaluate(drawn, DRAWN)
        shot = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
        picture = np.asarray(shot).astype(int)
        if before is not None and not (picture != before).any():
            return picture
        before = picture
    raise AssertionError("the picture does not come to rest")


def find_arm(site, log, rows, frame):
    """Columns and rows of the nodes, shape (N, 2), pixels, by the camera that the page begins with."""
    radius, crown = site.tank.shell.inner_diameter / 2, site.tank.shell.crown
    aside = 0.16 * radius
    eye, target = np.array([aside, -2.35 * radius, 0.9 * crown]), np.array([aside, 0.0, 0.52 * crown])
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    record = int(np.argmin(np.abs(log.time - rows["times"][frame])))
    away = log.nodes[record] - eye
    height = SIZE[1] - 40  # of the picture; the bar of the player is below it
    scale = height / 2 / np.tan(np.radians(19)) / (away @ forward)
    return np.stack(
        [SIZE[0] / 2 + scale * (away @ right), height / 2 - scale * (away @ np.cross(right, forward))], axis=-1
    )


def test_it_plays_by_itself_without_a_network(page):
    first = find_time(page)
    page.wait_for_function(f"{NOW} > {first}")
    assert page.title().endswith("Synthetic tour of four goals & a <sanity> check")
    assert page.wrong == []
    assert all(url.startswith(("file:", "data:", "blob:")) for url in page.wanted)


def test_it_is_drawn_as_cheaply_as_the_live_page(page):
    page.wait_for_function("window.__viserMutable.backgroundMaterial.visible === false")


def test_the_slider_moves_the_arm_and_the_readings(page, drawn, file, site, log):
    rows = json.loads(re.search(r"const run = (\{.*?\});\n", file.read_text(encoding="utf-8"))[1])
    for _ in range(TRIES):  # where a busy browser gave the picture of the place before, the three do not fit together
        pictures, arms = [], []
        for part in (EARLY, LATE, EARLY):
            picture, frame = go(page, drawn, part)
            pictures.append(picture[: SIZE[1] - 60, :SEEN])
            arms.append(find_arm(site, log, rows, frame))
            cells = page.locator("#run td").all_inner_texts()
            assert cells == [f"{rows['times'][frame]:.2f} s", *rows["rows"][frame]]
        early, late, again = pictures
        changed, back = (np.abs(early - other).max(axis=-1) > STEP for other in (late, again))
        if changed.mean() > 0.002 and back.mean() < 0.1 * changed.mean():
            break
    else:
        raise AssertionError(f"{back.mean():.4f} of the picture differ, {changed.mean():.4f} from the other place")
    row, column = np.nonzero(changed)
    near = np.zeros(len(row), bool)
    for arm in arms[:2]:
        low, high = arm.min(axis=0) - BESIDE, arm.max(axis=0) + BESIDE
        near |= (column > low[0]) & (column < high[0]) & (row > low[1]) & (row < high[1])
    assert near.mean() > 0.7  # goals that take turns are the rest


def test_the_arm_has_the_colours_of_its_forces(page, drawn, site, log, file):
    rows = json.loads(re.search(r"const run = (\{.*?\});\n", file.read_text(encoding="utf-8"))[1])
    picture, frame = go(page, drawn, EARLY)
    arm = find_arm(site, log, rows, frame)
    (left, top), (right, bottom) = np.clip(
        np.stack([arm.min(axis=0), arm.max(axis=0)]), 0, (SEEN, SIZE[1] - 60)
    ).astype(int)
    r, g, b = np.moveaxis(picture[top:bottom, left:right], -1, 0)
    assert ((r > 140) & (g < 0.6 * r) & (b < 0.6 * r)).sum() > 20  # compression
    assert ((b > 140) & (r < 0.8 * b) & (b - r > 50)).sum() > 20  # tension


def test_the_player_pauses_and_goes_on(page, drawn):
    _, frame = go(page, drawn, EARLY)
    stands = find_time(page)
    page.wait_for_timeout(500)
    assert find_time(page) == stands
    page.locator("body").press("Space")
    page.wait_for_function(f"Number(document.getElementById('run').dataset.frame) > {frame}")
