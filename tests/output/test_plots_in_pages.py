"""Plots of the report in a browser: the value under the pointer is told, and a plot is shown large."""

import json
import re
import shutil
import subprocess
from html import unescape

import numpy as np
import pytest

from vgtsim.output.html_report import describe_run, write_page

pytestmark = pytest.mark.long

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
TOLD = 2e-3  # relative: the pointer stands on a whole pixel, and four digits are told
AT = 0.4  # of the axes' width, where the pointer points
POINT = """<script>
addEventListener("load", () => {
  const svg = document.querySelector("#clearance").parentElement.querySelector("svg");
  const {box} = JSON.parse(svg.dataset.axes)[0], spot = new DOMPoint(box[0] + %s * (box[2] - box[0]), (box[1] + box[3]) / 2);
  const screen = spot.matrixTransform(svg.getScreenCTM());
  svg.dispatchEvent(new PointerEvent("pointermove", {clientX: screen.x, clientY: screen.y, bubbles: true}));
  document.body.dataset.told = document.querySelector(".tip").innerText;
  svg.dispatchEvent(new MouseEvent("click"));
  document.body.dataset.large = document.querySelectorAll("dialog[open] svg").length;
});
</script></body>"""


def described(page, name):
    """Axes of a plot as its page describes them."""
    figure = page[page.index(f'<h3 id="{name}">') :]
    return json.loads(unescape(re.search(r'data-axes="([^"]*)"', figure)[1]))


@pytest.fixture(scope="module")
def page(judged, tmp_path_factory):
    file = tmp_path_factory.mktemp("page") / "report.html"
    write_page(describe_run(judged), file)
    return file.read_text(encoding="utf-8")


def test_what_a_page_can_tell_is_the_series(page, log, report):
    (axes,) = described(page, "clearance")
    (line,) = axes["lines"]
    assert axes["x"] == [log.time[0], pytest.approx(log.time[-1], rel=1e-5)]
    told = np.interp(report.series["clearance_time"], line["x"], line["y"])
    assert told == pytest.approx(1e3 * np.asarray(report.series["clearance"]), rel=1e-2)
    assert all(axes["lines"] for axes in described(page, "axial"))


@pytest.mark.skipif(BROWSER is None, reason="no browser; on Debian: apt-get install chromium")
def test_the_value_under_the_pointer_is_told_and_a_plot_opens(page, log, report, tmp_path):
    path = tmp_path / "report.html"
    path.write_text(page.replace("</body>", POINT % AT), encoding="utf-8")
    flags = [
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--window-size=1100,900",
        f"--user-data-dir={tmp_path}/b",
    ]
    shown = subprocess.run([BROWSER, *flags, "--dump-dom", path.as_uri()], capture_output=True, text=True, timeout=600)
    told = re.search(r'data-told="([^"]*)"', shown.stdout)[1].split("\n")
    time, clearance = (float(line.split()[-1]) for line in told)
    assert time == pytest.approx(log.time[0] + AT * (log.time[-1] - log.time[0]), rel=TOLD)
    expected = np.interp(time, report.series["clearance_time"], 1e3 * np.asarray(report.series["clearance"]))
    assert clearance == pytest.approx(expected, rel=1e-2)
    assert 'data-large="1"' in shown.stdout
