"""The controls against a page that sends what no person can do with them: refused by name, and as they were before."""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest

from vgtsim.errors import CommandError

viser = pytest.importorskip("viser")

from viser import _messages as messages  # noqa: E402

from vgtsim.web.controls import Controls, read_handle  # noqa: E402
from vgtsim.web.letters import LiveState  # noqa: E402

UP = (1.0, 0.0, 0.0, 0.0)


def finish(coroutine):
    """Run what viser would run in its own thread; a browser of other tests may have a loop in this one."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, coroutine).result()


class Desk:
    """Controls in a server without a page; what a page would send is handed to viser."""

    def __init__(self, site):
        self.site, self.posted = site, []
        self.server = viser.ViserServer("127.0.0.1", 0, verbose=False)
        self.server.gui._resolve_client = lambda _: SimpleNamespace(client_id=0)
        self.controls = Controls(self.server, site, 80e3, self.posted.append)

    def send(self, handle, value):
        finish(self.server.gui._handle_gui_updates(0, messages.GuiUpdateMessage(handle._impl.uuid, {"value": value})))

    def turn(self, position, wxyz, phase="update"):
        kept = self.controls._handle._impl
        kept.position, kept.wxyz = np.array(position), np.array(wxyz)
        event = SimpleNamespace(client=object(), phase=phase, target=SimpleNamespace(position=position, wxyz=wxyz))
        finish(self.controls._on_handle(event))

    def show(self):
        """Show the start; what is said to the person."""
        site = self.site
        nodes = site.chain.nodes(site.start)
        tool, direction = site.chain.tool(site.start)
        state = LiveState(
            time=0.0, rate=50.0, nodes=nodes, tool=tool, axial=np.zeros(len(site.truss.members)),
            lengths=site.chain.lengths(site.start), target=np.concatenate([tool, direction]), condition=30.0, utilisation=0.5,
            member="", held_by=(), playing=True, record="", ended="", said="", arrived=0.0,
        )  # fmt: skip
        self.controls.show(state, "1 m", 0.0)
        return self.controls._state.content


@pytest.fixture
def desk(site):
    desk = Desk(site)
    yield desk
    desk.server.stop()


def test_a_slider_beyond_its_ends_is_refused_by_name_and_goes_back(desk):
    slider, other = desk.controls._sliders[:2]
    before = slider.value
    for value in (99999, -5):
        desk.send(slider, value)
        assert desk.posted == []
        words = desk.show()
        assert f"{slider.label}: found {value} mm; allowed: " in words
        assert slider.value == before
    desk.send(other, other.value + 1)
    assert desk.posted[-1].value[0] == pytest.approx(before / 1e3)
    assert "found" not in desk.show()


@pytest.mark.parametrize(
    ("position", "wxyz", "words"),
    [
        ((np.nan, 0.0, 0.0), UP, "handle: found nan at 0"),
        ((0.0, 0.0), UP, "handle: found shape (2,); allowed: shape (3,)"),
        ("up", UP, "handle: found 'up'"),
        ((0.0, 0.0, 0.0), (1.0, 0.0), "turn of the handle: found shape (2,)"),
        ((0.0, 0.0, 0.0), (0.0,) * 4, "turn of the handle: found length 0; allowed: length 1"),
        ((0.0, 0.0, 0.0), (np.inf, 0.0, 0.0, 0.0), "turn of the handle: found inf at 0"),
    ],
)
def test_a_pose_of_the_handle_that_is_none_is_refused_and_the_handle_goes_back(desk, position, wxyz, words):
    with pytest.raises(CommandError) as refused:
        read_handle(position, wxyz)
    assert words in str(refused.value)
    for wished in (None, [-9.0, 2.0, 3.0, 0.0, 0.0, 1.0]):
        if wished:
            desk.turn(wished[:3], UP)
            assert desk.posted.pop().value == wished
        desk.turn(position, wxyz)
        assert desk.posted == []
        assert str(refused.value).replace("'", "&#x27;") in desk.show()
        place = wished[:3] if wished else desk.site.chain.tool(desk.site.start)[0]
        assert np.allclose(desk.controls._handle.position, place)


def test_what_is_no_choice_is_refused_and_the_menu_goes_back(desk):
    for menu in (desk.controls._objective, desk.controls._method):
        desk.send(menu, "speed")
        assert f"{menu.label}: found &#x27;speed&#x27;; allowed: one of {menu.options[0]}" in desk.show()
        assert menu.value == menu.options[0]
        assert desk.posted == []
    desk.send(desk.controls._objective, "mid_stroke")
    assert desk.posted.pop().objective == ("mid_stroke",)
