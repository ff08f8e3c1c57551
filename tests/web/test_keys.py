"""Keys at a page: those of a slider move the slider, and the view stays."""

from __future__ import annotations

import io
import time

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("viser")

from vgtsim.web.serving import open_client

pytestmark = pytest.mark.long

SCENE = (0, 170, 270, 400)  # the part of the page without panel and messages
HELD = 400  # ms that a key is down: it turns the view by a tenth
PATIENCE = 600  # s: on a machine that does other things besides
DRAWN = 8  # pictures in which the view comes to rest


def test_arrow_keys_on_a_slider_move_it_and_do_not_turn_the_view(browser, drawn, tmp_path):
    server = open_client("127.0.0.1", 0, "keys", tmp_path)
    server.scene.configure_environment_map(None)  # whose first picture takes a processor five seconds
    server.scene.configure_default_lights(cast_shadow=False)
    server.scene.add_box("/box", color=(200, 30, 30), dimensions=(3.0, 0.5, 0.5))
    slider = server.gui.add_slider("length", 0, 100, 1, 50)
    page = browser.new_page(viewport={"width": 600, "height": 400})
    page.set_default_timeout(1e3 * PATIENCE)
    page.goto(f"http://127.0.0.1:{server.get_port()}")
    handle = page.get_by_role("slider")
    handle.wait_for(state="attached")

    def look():
        picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB").crop(SCENE)
        return np.asarray(picture, int)[..., 0] - np.asarray(picture, int)[..., 1] > 60

    until = time.monotonic() + PATIENCE
    while look().sum() <= 500 and time.monotonic() < until:
        page.evaluate(drawn, 1)

    def hold(key):
        page.evaluate(drawn, DRAWN)
        before = look()
        page.keyboard.down(key)
        page.wait_for_timeout(HELD)
        page.evaluate(drawn, DRAWN)
        page.keyboard.up(key)
        page.evaluate(drawn, DRAWN)
        return np.mean(look() != before) / before.mean()

    handle.focus()
    assert hold("ArrowRight") == 0
    while slider.value <= 50 and time.monotonic() < until:
        page.wait_for_timeout(50)
    assert slider.value > 50
    page.evaluate("document.activeElement.blur()")
    assert hold("ArrowRight") > 0.05  # elsewhere keys turn the view, as viser has it
    page.close()
    server.stop()
