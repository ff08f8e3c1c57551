"""The controls against a page that sends what no person can do with them: refused by name, and as they were before."""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vgtsim.errors import CommandError

viser = pytest.importorskip("viser")

from viser import _messages as messages  # noqa: E402

from vgtsim.web import controls  # noqa: E402
from vgtsim.web.controls import Controls, read_handle  # noqa: E402
from vgtsim.web.letters import Button, LiveState  # noqa: E402

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

    def show(self, playing=True):
        """Show the start; what is said to the person."""
        site = self.site
        nodes = site.chain.nodes(site.start)
        tool, direction = site.chain.tool(site.start)
        state = LiveState(
            time=0.0, rate=50.0, nodes=nodes, tool=tool, axial=np.zeros(len(site.truss.members)),
            lengths=site.chain.lengths(site.start), target=np.concatenate([tool, direction]), condition=30.0, utilisation=0.5,
            member="", held_by=(), playing=playing, record="", ended="", said="", arrived=0.0,
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


def test_a_slider_that_was_moved_stays_for_a_second_and_then_follows_the_arm(desk, monkeypatch):
    clock = [1000.0]
    monkeypatch.setattr(controls, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    slider = desk.controls._sliders[0]
    before = slider.value
    desk.send(slider, before + 40)
    assert 1e3 * desk.posted[-1].value[0] == pytest.approx(before + 40)
    desk.controls._want("hold", True)
    for later, place in ((0.9, before + 40), (0.2, before)):
        clock[0] += later
        desk.show()
        assert slider.value == place


def test_a_handle_turned_any_way_is_a_goal_along_its_z():
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7])
    goal = read_handle((1.0, 2.0, 3.0), turn.as_quat(scalar_first=True))
    assert goal == pytest.approx([1.0, 2.0, 3.0, *turn.apply([0.0, 0.0, 1.0])], abs=1e-12)


def test_a_handle_stays_in_the_hand_and_goes_to_the_tool_when_it_is_let_go(desk):
    desk.send(desk.controls._method, controls._POSTURE)  # nothing is wanted before it is let go
    away, tool = (-9.0, 2.0, 3.0), desk.site.chain.tool(desk.site.start)[0]
    desk.turn(away, UP)
    desk.show()
    assert np.allclose(desk.controls._handle.position, away)
    desk.send(desk.controls._method, controls._STRAIGHT)
    desk.turn(away, UP, "end")
    assert desk.posted[-1].value == [*away, 0.0, 0.0, 1.0]
    desk.show()
    assert np.allclose(desk.controls._handle.position, away)  # where the arm is to go
    desk.controls._want("hold", True)
    desk.show()
    assert np.allclose(desk.controls._handle.position, tool)


def test_the_button_pauses_what_plays_and_plays_what_is_paused(desk):
    for playing, letter, after in ((True, Button.PAUSE, "Play"), (False, Button.PLAY, "Pause")):
        finish(desk.controls._on_play(None))
        assert desk.posted.pop() is letter
        desk.show(playing=not playing)
        assert desk.controls._play.label == after


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
