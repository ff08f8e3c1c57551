"""A live session whole: its two processes, their addresses and ends, and a person at a browser without a screen."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
import time

import numpy as np
import pytest
from PIL import Image

from vgtsim.description import load_commands
from vgtsim.errors import PageError

pytest.importorskip("viser")

from vgtsim.cli import main
from vgtsim.web.session import require_port

pytestmark = pytest.mark.long

PATIENCE = 600  # s: on a machine that does other things besides
SIZE = {"width": 1280, "height": 720}
SLOW = 9  # s after which a client that draws slowly has long noticed
AWAY = 6  # s
PICTURE = (320, 0, 940, 720)  # the part of the page without panel and messages

KEEP = """
window.given = [];
const give = WebGL2RenderingContext.prototype.shaderSource;
WebGL2RenderingContext.prototype.shaderSource = function (shader, text) {
  window.given.push(text);
  return give.call(this, shader, text);
};
"""
MESSAGE, HEAD = 160, 7  # pixels: height of the browser's message, and from the tip of an arrow into its head


def test_a_port_in_use_is_said_before_anything_starts(monkeypatch, capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(PageError, match="Address already in use; choose another --port"):
            require_port("127.0.0.1", port)
        monkeypatch.setattr(sys, "argv", ["vgtsim", "live", "type_ii_reach", "--no-open", "--port", str(port)])
        with pytest.raises(SystemExit) as ended:
            main()
    assert ended.value.code == 2
    assert f"127.0.0.1:{port}: Address already in use" in capsys.readouterr().err
    require_port("127.0.0.1", port)


def test_an_address_of_no_machine_is_said():
    with pytest.raises(PageError, match=r"198\.51\.100\.7:8080"):
        require_port("198.51.100.7", 8080)


class Served:
    """The verb in a process of its own."""

    def __init__(self, folder):
        self.folder = folder
        words = ["live", "type_ii_reach", "--no-open", "--port", "0", "--record", "--out", str(folder)]
        self.process = subprocess.Popen(
            [sys.executable, "-c", "from vgtsim.cli import main; main()", *words],
            stdout=subprocess.PIPE,
            text=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a job in the background ignores it
        )
        self.said = self.process.stdout.readline() + self.process.stdout.readline()
        self.address = re.search(r"http://127\.0\.0\.1:\d+", self.said).group()

    @property
    def commands(self):
        file = self.folder / "type_ii_reach_live_1.jsonl"
        return load_commands(file) if file.stat().st_size else ()

    def end(self):
        self.process.send_signal(signal.SIGINT)
        rest = self.process.communicate(timeout=PATIENCE)[0]
        return self.process.returncode, rest


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    served = Served(tmp_path_factory.mktemp("live"))
    yield served
    if served.process.poll() is None:
        served.process.kill()
        served.process.communicate()


class Person:
    """Someone at the page."""

    def __init__(self, page):
        self.page = page
        self.wait(lambda: page.locator("th").count() > 0)
        self.came = time.monotonic()

    def read(self, name):
        """A figure of the panel."""
        return self.page.locator(f"tr:has(th:text-is('{name}')) td").inner_text()

    @property
    def time(self):
        return float(self.read("time").split()[0])

    def wait(self, condition):
        until = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < until, self.page.inner_text("body")
            self.page.wait_for_timeout(50)

    def find_arrow(self, file):
        """The head of the handle's red arrow, which points up and is at the left of the page, pixels."""
        self.page.screenshot(path=file)
        red, green, blue = np.moveaxis(np.asarray(Image.open(file).convert("RGB"), int)[MESSAGE:, : PICTURE[0]], -1, 0)
        rows, columns = np.nonzero((red > 200) & (green < 90) & (blue < 140))
        top = int(np.argmin(rows))
        return int(columns[top]), int(rows[top]) + MESSAGE + HEAD

    def picture(self, file):
        self.page.screenshot(path=file)
        return np.asarray(Image.open(file).convert("RGB").crop(PICTURE), float)


@pytest.fixture(scope="module")
def person(served, browser):
    page = browser.new_page(viewport=SIZE)
    page.set_default_timeout(1e3 * PATIENCE)
    page.add_init_script(KEEP)
    page.goto(served.address)
    yield Person(page)
    page.close()


class TestBrowser:
    """One page after the other, in this order, at one session."""

    def test_the_page_shows_the_tank_the_arm_and_its_figures(self, person, tmp_path):
        first = person.time
        person.wait(lambda: person.time > first)
        assert person.read("clearance").startswith("0.504 m, payload to tank")
        assert person.read("held by") == "nothing"
        words = person.page.inner_text("body")
        for text in ("compression", "tension, kN", "Goal", "Objective", "m1/actuator/1", "m5/actuator/3", "Start anew"):
            assert text in words
        pictures = []

        def is_full():
            pictures.append(person.picture(tmp_path / "a.png"))
            return pictures[-1].std() > 30

        person.wait(is_full)
        red, green, blue = np.moveaxis(pictures[-1], -1, 0)
        assert np.sum((red > green + 60) & (red > blue + 60)) > 50  # members in compression
        assert np.sum((blue > red + 40) & (blue > green)) > 50  # and in tension

    def test_a_page_drawn_by_software_does_not_smooth_its_edges(self, person):
        """The context of the picture, as it was made."""
        smooth = """() => [...document.querySelectorAll("canvas")].map(canvas => canvas.getContext("webgl2"))
            .filter(Boolean).map(context => context.getContextAttributes().antialias)"""
        drawn = person.page.evaluate(smooth)
        assert drawn
        assert not any(drawn)

    def test_its_curve_of_light_is_a_root(self, person):
        """Every shader that the graphics were given."""
        given = [text for text in person.page.evaluate("window.given") if "sRGBTransferOETF( in vec4 value )" in text]
        assert given
        assert all("1.138 * sqrt( value.rgb )" in text for text in given)
        assert not any("0.41666" in text for text in given)

    def test_a_slider_moves_the_arm(self, person, served, tmp_path):
        page, before = person.page, person.picture(tmp_path / "a.png")
        box = page.locator("input[type=text], input[inputmode]").filter(visible=True)
        values = [box.nth(k).input_value() for k in range(box.count())]
        first = next(k for k, value in enumerate(values) if value.isdecimal())
        wanted = int(values[first]) - 60
        box.nth(first).fill(str(wanted))
        box.nth(first).press("Enter")
        person.wait(lambda: len(served.commands) > 0)
        command = served.commands[-1]
        assert command.target == "lengths"
        assert command.lengths[0] == pytest.approx(wanted / 1e3)
        clearance = person.read("clearance")
        person.wait(lambda: person.read("clearance") != clearance)

        def find_moved():
            return np.abs(person.picture(tmp_path / "b.png") - before).max(axis=-1) > 40

        person.wait(lambda: find_moved().sum() > 500)  # pixels of the arm: it is elsewhere
        assert find_moved().mean() < 0.1  # and the tank is not

    def test_the_handle_is_dragged_and_the_arm_follows(self, person, served, drawn, tmp_path):
        page = person.page
        before = person.time
        page.get_by_role("button", name="Start anew").click()
        person.wait(lambda: person.time < before)
        page.get_by_role("button", name="Record").click()
        person.wait(lambda: person.read("record") != "off")
        x, y = person.find_arrow(tmp_path / "a.png")
        page.mouse.move(x, y)
        page.evaluate(drawn, 4)
        page.mouse.down()
        for k in range(1, 7):
            page.mouse.move(x - 2 * k, y - 10 * k)
            page.evaluate(drawn, 2)
        page.mouse.up()
        file = served.folder / "type_ii_reach_live_2.jsonl"
        start = np.array([-10.617, 1.872, 2.954])
        person.wait(lambda: file.stat().st_size > 0)
        person.wait(lambda: np.linalg.norm(np.array(load_commands(file)[-1].goal[:3]) - start) > 0.3)
        assert {item.target for item in load_commands(file)} == {"goal"}
        person.wait(lambda: not person.read("clearance").startswith("0.504"))

    def test_it_draws_every_point_and_nothing_behind_the_scene(self, person):
        """A slow client draws fewer points after some seconds, and asks at each point for a picture behind all."""
        drawn = "(canvas => [canvas.width, canvas.height])(window.__viserMutable.canvas)"
        person.page.wait_for_timeout(1e3 * max(person.came + SLOW - time.monotonic(), 0))
        assert person.page.evaluate(drawn) == [SIZE["width"], SIZE["height"]]
        assert person.page.evaluate("window.__viserMutable.backgroundMaterial.visible") is False

    def test_pause_and_play(self, person):
        page = person.page
        page.get_by_role("button", name="Pause").click()
        person.wait(lambda: person.read("time").endswith("paused"))
        stands = person.time
        page.wait_for_timeout(500)
        assert person.time == stands
        page.get_by_role("button", name="Play").click()
        person.wait(lambda: person.time > stands)

    def test_a_run_whose_browser_goes_away_waits_for_it(self, person):
        page = person.page
        address, gone = page.url, person.time
        page.goto("about:blank")
        page.wait_for_timeout(1e3 * AWAY)
        page.goto(address)
        person.wait(lambda: page.locator("th").count() > 0)
        assert person.time < gone + AWAY - 1

    def test_an_interrupted_session_ends_well_and_its_records_are_whole(self, person, served):
        status, _ = served.end()
        assert status == 0
        assert served.commands[-1].target == "hold"
