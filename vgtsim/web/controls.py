"""The controls of a live arm beside its picture: what they show, and the letters that they post."""

from __future__ import annotations

import html
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from math import isnan, nan
from typing import Any

import numpy as np
import viser
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.commands import read_row
from vgtsim.control import find_posture
from vgtsim.description import OBJECTIVES
from vgtsim.errors import CommandError, VgtError
from vgtsim.kinematics import quaternions_to
from vgtsim.site import Site
from vgtsim.web.display import draw_scale
from vgtsim.web.letters import Button, Letter, LiveState, Wish

_SCENE, _NOTHING = "as the scene", "nothing"  # choices of the objective beside its names
_STRAIGHT, _POSTURE = "straight, at once", "to a posture, when let go"  # what the arm does with the place of the handle
_TEXT_EVERY, _SLIDER_EVERY = 0.2, 0.5  # s between changes of texts, and of sliders that follow the arm
_TOUCHED = 1.0  # s for which a slider that was moved is left where it is
_MILLI = 1e3  # sliders are in mm
_HANDLE = 1.5  # m: size of the handle
_UNIT = 1e-3  # by which a quaternion in a page's numbers may miss length 1


class Controls:
    """Handle at the tool, buttons, menus, figures and a slider for each cylinder, in a viser server.

    What is moved last is what the arm follows: the handle is a goal, the sliders are lengths.
    """

    def __init__(self, server: viser.ViserServer, site: Site, end: float, post: Callable[[Letter], None]) -> None:
        """Add the controls; the colour scale ends at an axial force, N, and letters are posted as they arise."""
        self._site, self._post, gui = site, post, server.gui
        self._wish = Wish(target="hold", value=True)
        self._lengths: Array | None = None  # that the sliders ask for, while the arm follows them
        self._box = np.ceil(_MILLI * site.box.least), np.floor(_MILLI * site.box.greatest)
        self._next = {"text": 0.0, "sliders": 0.0}
        self._latest = np.asarray(site.chain.lengths(site.start))  # wanted lengths of the last state
        self._state = gui.add_html("")
        self._play = gui.add_button("Pause")
        self._record = gui.add_button("Record")
        self._add_button(gui, "Hold", lambda: self._want("hold", True))
        self._add_button(gui, "Start anew", lambda: self._start_anew())
        hint = "Straight by resolved rates, or by a posture that Newton's method finds."
        self._method = gui.add_dropdown("Goal", (_STRAIGHT, _POSTURE), hint=hint)
        choices = (_SCENE, _NOTHING, *OBJECTIVES)
        self._objective = gui.add_dropdown("Objective", choices, hint="What the null space is used for.")
        gui.add_html(draw_scale(end))
        self._play.on_click(self._on_play)
        self._record.on_click(self._on_record)
        self._objective.on_update(self._on_choice)
        self._method.on_update(self._on_choice)
        with gui.add_folder("Cylinders, mm"):
            self._sliders = [self._add_slider(gui, j) for j in range(len(site.truss.actuated))]
        self._touched = np.zeros(len(self._sliders))
        self._handle = server.scene.add_transform_controls("/handle", scale=_HANDLE, depth_test=False)
        self._handle.on_update(self._on_handle)
        self._held_by_hand, self._said = False, ""
        self._astray = False  # whether the handle is where a page put it that was refused
        self._solver, self._asked = ThreadPoolExecutor(1), 0
        self._playing, self._recording = True, False
        self._told: tuple[object, ...] = ()  # what is shown at once, and not with the next figures

    def show(self, state: LiveState, gap: str, delay: float) -> None:
        """Show a state, with the gap to the nearest thing in words, and the last delay, s."""
        now, self._latest = time.monotonic(), state.lengths
        if self._astray or (not self._held_by_hand and self._wish.target != "goal"):
            self._put_handle(np.asarray(self._wish.value) if self._wish.target == "goal" else state.target)
        told = state.playing, state.record, state.ended, state.said or self._said
        if now >= self._next["text"] or told != self._told:
            self._told = told
            self._next["text"] = now + _TEXT_EVERY
            self._state.content = describe(state, gap, delay, state.said or self._said)
        if now >= self._next["sliders"] or not state.time:
            self._next["sliders"] = now + _SLIDER_EVERY
            self._move_sliders(state.lengths, now)
        if state.playing != self._playing:
            self._playing, self._play.label = state.playing, "Pause" if state.playing else "Play"
        if bool(state.record) != self._recording:
            self._recording, self._record.label = bool(state.record), "End the record" if state.record else "Record"

    def _put_handle(self, pose: Array) -> None:
        """Put the handle at a point, m, with its z along a direction, shape (6,).

        Viser keeps what a page sends, and cannot go from there where it is no pose.
        """
        kept = self._handle._impl
        if self._astray or kept.position.shape != (3,) or kept.wxyz.shape != (4,):
            kept.position, kept.wxyz, self._astray = np.full(3, nan), np.full(4, nan), False
        self._handle.position, self._handle.wxyz = pose[:3], quaternions_to(pose[None, 3:])[0]

    def _move_sliders(self, lengths: Array, now: float) -> None:
        """Let sliders that nobody moves follow the arm, or stay at what they ask for."""
        wanted = lengths if self._lengths is None else self._lengths
        places = np.clip(np.round(_MILLI * wanted), *self._box).astype(int).tolist()
        for slider, place, touched in zip(self._sliders, places, self._touched, strict=True):
            if slider.value != place and now - touched > _TOUCHED:
                slider.value = place

    def _add_button(self, gui: viser.GuiApi, label: str, act: Callable[[], None]) -> None:
        button = gui.add_button(label)

        @button.on_click
        async def _(_: Any) -> None:
            act()

    def _add_slider(self, gui: viser.GuiApi, j: int) -> viser.GuiSliderHandle[int]:
        site, (low, high) = self._site, self._box
        name = site.truss.member_names[site.truss.actuated[j]]
        now = int(np.clip(round(_MILLI * float(site.chain.lengths(site.start)[j])), low[j], high[j]))
        slider = gui.add_slider(name, int(low[j]), int(high[j]), 1, now)

        @slider.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                self._touched[j] = time.monotonic()
                self._want_lengths(j)

        return slider

    def _want_lengths(self, j: int) -> None:
        """Ask for the lengths of all sliders, of which one was moved: those that were not touched are where the arm is.

        What lies beyond the ends of the slider, which no slider sends, is refused and changes nothing.
        """
        slider, (low, high) = self._sliders[j], self._box
        if not low[j] <= slider.value <= high[j]:
            self._said = str(CommandError(slider.label, f"{slider.value} mm", f"{low[j]:.0f} to {high[j]:.0f} mm"))
            self._touched[j] = self._next["sliders"] = 0.0  # it goes back with the next state
            return
        self._lengths = np.array([slider.value for slider in self._sliders]) / _MILLI
        self._want("lengths", self._lengths)

    async def _on_handle(self, event: viser.TransformControlsEvent) -> None:
        if event.client is None:
            return
        self._held_by_hand = event.phase != "end"
        try:
            goal = read_handle(event.target.position, event.target.wxyz)
        except CommandError as error:
            self._said, self._held_by_hand, self._astray = str(error), False, True
            return
        if self._method.value == _STRAIGHT:
            self._want("goal", goal)
        elif event.phase == "end":
            self._solve(goal)

    def _solve(self, goal: list[float]) -> None:
        """Look for a posture beside the page, which may take seconds, and ask for its lengths; a newer wish overtakes it."""
        self._asked += 1
        asked, lengths, objective = self._asked, self._latest, self._choose_objective()
        self._said = "looking for a posture"

        def find() -> None:
            try:
                near = self._site.chain.inputs_from_lengths(lengths, self._site.start)
                posture = find_posture(self._site, goal, np.asarray(near), objective)
            except VgtError as error:
                self._said = str(error)
                return
            if asked == self._asked:
                self._said, self._lengths = "", posture
                self._want("lengths", posture)

        self._solver.submit(find)

    async def _on_choice(self, event: Any) -> None:
        """Say again what was wanted, with the objective that is chosen now; what is no choice is refused."""
        if event.client is None:
            return
        menu = event.target
        if menu.value not in menu.options:
            self._said = str(CommandError(menu.label, repr(menu.value), f"one of {', '.join(menu.options)}"))
            menu.value = menu.options[0]
        elif menu is self._objective:
            self._want(self._wish.target, self._wish.value)

    async def _on_play(self, _: Any) -> None:
        self._post(Button.PAUSE if self._playing else Button.PLAY)

    async def _on_record(self, _: Any) -> None:
        self._post(Button.END_RECORD if self._recording else Button.RECORD)

    def _start_anew(self) -> None:
        self._post(Button.ANEW)
        self._lengths, self._wish = None, Wish(target="hold", value=True)

    def _want(self, target: str, value: Any) -> None:
        """Post a wish, with the objective that is chosen."""
        if target != "lengths":
            self._lengths = None
        self._asked, self._said = self._asked + 1, ""
        self._wish = Wish(target=target, value=value, objective=self._choose_objective(), arrived=time.monotonic())
        self._post(self._wish)

    def _choose_objective(self) -> tuple[str, ...]:
        chosen = self._objective.value
        return {_SCENE: self._site.task.motion.objective, _NOTHING: ()}.get(chosen, (chosen,))


def read_handle(position: ArrayLike, wxyz: ArrayLike) -> list[float]:
    """Goal, point, m, and direction, 6 numbers, of a handle at a position, m, with a turn, whose z is the tool's direction.

    Raises:
        CommandError: A size is wrong, something is not finite, or the turn is not of length 1; a page may send anything.
    """
    point, turn = read_row("handle", position, 3), read_row("turn of the handle", wxyz, 4)
    if abs(np.linalg.norm(turn) - 1) > _UNIT:
        raise CommandError("turn of the handle", f"length {np.linalg.norm(turn):.3g}", "length 1")
    w, x, y, z = turn.tolist()
    along = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
    return [*point.tolist(), *along]


def describe(state: LiveState, gap: str, delay: float, said: str = "") -> str:
    """The figures of a state as a table in HTML, with what is to be said to the person above it."""
    speeds = [f"{state.rate:.1f} cycles a second"] * (not isnan(state.rate))
    speeds += [f"{1e3 * delay:.0f} ms from command to page"] * (not isnan(delay))
    rows = {
        "time": f"{state.time:.1f} s{'' if state.playing else ', paused'}",
        "clearance": gap,
        "utilisation": f"{state.utilisation:.2f}, {state.member}" if state.member else "not known yet",
        "condition": "not known yet" if isnan(state.condition) else f"{state.condition:.3g}",
        "held by": ", ".join(state.held_by) or "nothing",
        "loop": ", ".join(speeds),
        "record": state.record or "off",
    }
    texts = [f"ended: {state.ended}"] * bool(state.ended) + [said] * bool(said)
    words = "".join(f'<p role="status"><b>{html.escape(text)}</b></p>' for text in texts)
    head = '<th style="white-space: nowrap; padding-right: 1em">'
    cells = "".join(f"<tr>{head}{name}</th><td>{html.escape(text)}</td></tr>" for name, text in rows.items())
    style = "font-size: 0.8em; text-align: left; width: 100%; padding: 0 1em; overflow-wrap: anywhere"
    return f'<div style="{style}">{words}<table>{cells}</table></div>'
