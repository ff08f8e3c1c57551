"""The live loop at one end of a line, a page that is only letters at the other."""

from __future__ import annotations

from dataclasses import replace
from multiprocessing import Pipe

import numpy as np
import pytest

from vgtsim.description import load_commands, load_scene
from vgtsim.errors import PageError
from vgtsim.log import ARRAYS
from vgtsim.plant import operate
from vgtsim.site import Site, load_site

pytest.importorskip("viser")

from vgtsim.web.letters import Button, Line, LiveState, Pages, Served, Shown, Wish
from vgtsim.web.loop import PERIOD, LiveLoop
from vgtsim.web.tape import Tape, make_live

pytestmark = pytest.mark.long

DOWN = Wish(target="twist", value=[0.05, 0.0, -0.1, 0.0, 0.0, 0.0], arrived=1.0)


class Page:
    """The other end of the line, by hand: it shows a state when it is told to."""

    def __init__(self, loop_of):
        near, self.pipe = Pipe()
        self.now = 0.0
        self.slept = []
        self.loop = loop_of(Line(near), self.clock, self.sleep)
        self.post(Served(8080), Pages(1))

    def clock(self):
        return self.now

    def sleep(self, seconds):
        self.slept.append(seconds)
        self.now += seconds

    def post(self, *letters):
        for letter in letters:
            self.pipe.send(letter)

    def take(self) -> list[LiveState]:
        found = []
        while self.pipe.poll():
            found.append(self.pipe.recv())
        return found

    def go(self, cycles, *letters) -> LiveState:
        """Go on with a page that shows every state at once; the last state."""
        self.post(*letters)
        seen = None
        for _ in range(cycles):
            self.loop.cycle()
            for state in self.take():
                seen = state
                self.post(Shown(0.0, 0.0))
        assert seen is not None
        return seen


@pytest.fixture(scope="module")
def live(reach_scene):
    return make_live(Site(reach_scene))


@pytest.fixture
def page(live, tmp_path):
    def loop_of(line, clock, sleep):
        return LiveLoop(live, line, Tape(live, tmp_path / "records"), clock=clock, wait=sleep, every=1)

    page = Page(loop_of)
    yield page
    page.loop.tape.end()
    page.pipe.close()


def test_a_wish_moves_the_arm_and_the_state_follows_it(page):
    begin = page.go(1)
    assert begin.time == pytest.approx(PERIOD)
    seen = page.go(1, DOWN)
    assert seen.arrived == DOWN.arrived  # the state of the cycle in which it came
    last = page.go(60)
    assert last.arrived == 0.0
    assert last.tool[2] < begin.tool[2] - 0.01
    assert np.linalg.norm(last.tool - last.target[:3]) < 1e-3
    assert np.abs(last.axial - begin.axial).max() > 1.0
    assert not last.said


def test_a_record_replays_to_the_same_log(live, tmp_path):
    pieces = []

    def loop_of(line, clock, sleep):
        return LiveLoop(live, line, Tape(live, tmp_path), store=pieces.append, clock=clock, wait=sleep, every=1)

    page = Page(loop_of)
    page.go(5)
    page.go(20, DOWN)
    seen = page.go(10, Button.RECORD)  # what was before belongs to it
    file = tmp_path / f"{live.task.name}_1.jsonl"
    assert seen.record == str(file)
    wanted = (live.chain.lengths(live.start) + 0.003).tolist()
    page.go(30, Wish(target="lengths", value=wanted, objective=("mid_stroke",)))
    assert len(file.read_text().splitlines()) == 2  # on disk before the record ends
    page.go(7, Pages(0), Button.PLAY)
    page.go(12, Pages(1), Button.PAUSE)
    page.go(40, Button.PLAY, Wish(target="goal", value=[*(seen.tool + 0.05), *seen.target[3:]]))
    said = page.go(20, Button.END_RECORD)
    assert not said.record
    assert str(file) in said.said
    ended = load_commands(file)
    assert [item.target for item in ended] == ["twist", "lengths", "goal", "hold"]
    site = load_site(file.with_suffix(".toml"))
    assert site.scene.commands == ended
    assert np.array_equal(site.start, live.start)
    again, log = operate(site), page.loop.operation.plant.log
    assert pieces  # the first hundred records
    assert again.settled[-1]
    for name, (_, sizes) in ARRAYS.items():
        if sizes[0] == "T" and name in pieces[0]:
            mine = np.concatenate([*(piece[name] for piece in pieces), getattr(log, name)])
            assert len(mine) == 125
            assert np.array_equal(mine, getattr(again, name)[: len(mine)]), name


@pytest.mark.parametrize(
    ("wish", "words"),
    [
        (Wish(target="twist", value=[0.0, np.nan, 0, 0, 0, 0]), "twist: found nan at 1; allowed: finite numbers"),
        (Wish(target="lengths", value=[1.0, 1.2]), "lengths: found shape (2,); allowed: shape (15,)"),
        (Wish(target="goal", value=[0.0] * 6), "goal: found a direction of length 0"),
        (Wish(target="lengths", value=[9.0] * 15), "lengths: found m1/actuator/1 at 9.0000 m"),
        (Wish(target="goal", value="up"), "goal: found 'up'; allowed: 6 numbers"),
        (Wish(target="jump", value=True), "command: found 'jump'; allowed: one of twist"),
        (Wish(target="hold", value=True, objective=("speed",)), "speed"),
    ],
)
def test_a_wrong_command_is_said_by_name_and_changes_nothing(page, wish, words):
    page.go(3, Button.RECORD, DOWN)
    seen = page.go(2, wish)
    assert words in seen.said
    assert len(load_commands(page.loop.tape.file)) == 1
    assert page.go(30).tool[2] < seen.tool[2]  # the last good command goes on
    assert not page.go(2, Wish(target="hold", value=True)).said


def test_commands_after_the_end_are_refused_and_a_new_start_takes_them(page):
    page.go(3, Button.RECORD, DOWN)
    plant = page.loop.operation.plant
    step = plant.step

    def touch():
        step()
        plant.stopped = "contact of payload with waste"

    plant.step = touch
    seen = page.go(1)
    assert seen.ended == "contact of payload with waste"
    seen = page.go(5, DOWN)
    assert seen.said == "the plant cannot go on: contact of payload with waste"
    assert seen.time == pytest.approx(4 * PERIOD)
    kept = page.loop.tape.file
    seen = page.go(2, Button.ANEW)
    assert not seen.ended
    assert not seen.record
    assert len(load_commands(kept)) == 1  # nothing lost
    assert page.go(40, DOWN).tool[2] < seen.tool[2]


def test_time_goes_on_only_while_a_page_is_open(page):
    assert page.go(10).time == pytest.approx(10 * PERIOD)
    assert page.go(20, Pages(0)).time == pytest.approx(10 * PERIOD)
    assert page.go(5, Pages(2)).time == pytest.approx(15 * PERIOD)
    seen = page.go(5, Button.PAUSE)
    assert (seen.playing, seen.time) == (False, pytest.approx(15 * PERIOD))
    assert page.go(5, Pages(0), Pages(1)).time == pytest.approx(15 * PERIOD)  # paused by a person
    assert page.go(5, Button.PLAY).time == pytest.approx(20 * PERIOD)


def test_a_page_that_hangs_holds_nothing_up_and_sees_the_latest_state_afterwards(page):
    for _ in range(300):
        page.loop.cycle()
    states = page.take()
    assert len(states) == 1
    assert page.loop.operation.plant.time == pytest.approx(300 * PERIOD)
    page.post(Shown(0.01, 0.2))
    page.loop.cycle()
    assert [state.time for state in page.take()] == [pytest.approx(301 * PERIOD)]
    assert page.loop.shown[-1] == Shown(0.01, 0.2)


def test_a_state_is_sent_every_second_cycle_and_after_a_letter_at_once(live, tmp_path):
    page = Page(lambda line, clock, sleep: LiveLoop(live, line, Tape(live, tmp_path), clock=clock, wait=sleep))
    sent = []
    for cycle in range(12):
        if cycle == 5:
            page.post(DOWN)
        if cycle == 10:
            page.post(Button.PAUSE)
        page.loop.cycle()
        states = page.take()
        sent.append(len(states))
        if states:
            page.post(Shown(0.0, 0.0))
    assert sent == [1, 0, 1, 0, 1, 1, 0, 1, 0, 1, 1, 0]  # and what stands still is not sent again


def test_a_state_that_the_page_was_not_ready_for_is_sent_between_two_cycles(live, tmp_path):
    sent = []

    def wait(seconds):  # a quarter of a cycle; the page has shown the last state in the second one
        page.now += min(seconds, PERIOD / 4)
        sent.extend(round(page.now / PERIOD, 3) for _ in page.take())
        if page.now == pytest.approx(1.5 * PERIOD):
            page.post(Shown(0.0, 0.0))
        return page.loop.line.wait(0.0)

    page = Page(lambda line, clock, sleep: LiveLoop(live, line, Tape(live, tmp_path), clock=clock, wait=wait, every=1))
    counted = iter(range(10))
    page.loop.run(lambda: next(counted) >= 3)
    assert sent == [0.25, 1.75]


def test_a_command_does_not_wait_for_the_clock_and_the_cycles_after_it_keep_to_it(live, tmp_path):
    begun, sent = [], []

    def wait(seconds):  # a quarter of a cycle; a command comes at 1.25, at 1.5, and at 3.5 cycles
        page.now += min(seconds, PERIOD / 4)
        sent.extend((round(page.now / PERIOD, 3), state.arrived) for state in page.take())
        if any(page.now == pytest.approx(k * PERIOD) for k in (1.25, 1.5, 3.5)):
            page.post(replace(DOWN, arrived=round(page.now / PERIOD, 3)), Shown(0.0, 0.0))
        return page.loop.line.wait(0.0)

    page = Page(lambda line, clock, sleep: LiveLoop(live, line, Tape(live, tmp_path), clock=clock, wait=wait, every=1))
    work = page.loop.cycle

    def cycle():
        begun.append(round(page.now / PERIOD, 3))
        work()

    page.loop.cycle = cycle
    counted = iter(range(100))
    page.loop.run(lambda: next(counted) >= 6)
    assert begun == [0.0, 1.0, 1.25, 2.0, 3.5, 5.0]  # the second command waits: the loop is a cycle ahead
    answers = [(when, arrived) for when, arrived in sent if arrived]
    assert answers == [(1.5, 1.25), (2.25, 1.5), (3.75, 3.5)]  # and no older state comes before them


def test_of_wishes_for_one_thing_in_a_row_only_the_last_is_given(page):
    ways = [Wish(target="twist", value=[0.001 * k, 0, 0, 0, 0, 0]) for k in range(50)]
    page.go(1, *ways, Wish(target="hold", value=True), *ways[:3])
    assert [line.count("twist") for line in page.loop.tape._lines] == [1, 0, 1]


def test_cycles_keep_to_the_clock_and_a_stall_is_not_made_up_for(page):
    counted = iter(range(1000))
    page.loop.run(lambda: next(counted) >= 100)
    assert page.now == pytest.approx(100 * PERIOD)
    assert page.loop.tell().rate == pytest.approx(1 / PERIOD, rel=1e-6)
    work = page.loop.cycle

    def slow():
        work()
        page.now += 0.005

    page.loop.cycle, begin = slow, page.now  # what the work takes is taken from the sleep
    counted = iter(range(1000))
    page.loop.run(lambda: next(counted) >= 100)
    assert page.now - begin == pytest.approx(100 * PERIOD)
    due, stalls = page.now, iter([1.0])
    page.loop.cycle = lambda: setattr(page, "now", page.now + next(stalls, 0.0))
    counted = iter(range(1000))
    page.loop.run(lambda: next(counted) >= 100)
    caught_up = 100 * PERIOD - (page.now - due - 1.0)
    assert caught_up == pytest.approx(0.2 + PERIOD)  # and the cycle of the stall itself


def test_a_server_that_ends_is_said_and_the_record_stays(page):
    page.go(3, Button.RECORD, DOWN)
    file = page.loop.tape.file
    page.pipe.close()
    with pytest.raises(PageError, match="its server has ended"):
        page.loop.run()
    page.loop.end_record()
    assert [item.target for item in load_commands(file)] == ["twist", "hold"]


def test_a_full_disk_ends_the_record_and_not_the_run(page):
    page.go(3, Button.RECORD, DOWN)
    file = page.loop.tape.file

    class Full:
        def write(self, _):
            raise OSError(28, "No space left on device")

        def close(self):
            pass

    page.loop.tape._stream.close()
    page.loop.tape._stream = Full()
    seen = page.go(1, Wish(target="hold", value=True))
    assert "No space left" in seen.said
    assert not seen.record
    assert page.go(5).time > seen.time
    assert len(load_commands(file)) == 1
    page.go(1, Button.RECORD)  # somewhere with room: nothing is missing
    assert [item.target for item in load_commands(page.loop.tape.file)] == ["twist", "hold"]


@pytest.mark.parametrize("name", ["type_ii_mission", "live_limits", "arm9_nullspace"])
def test_any_scene_can_be_driven_and_its_record_is_a_scene(name, tmp_path):
    site = load_site(name)
    live = make_live(site)
    tape = Tape(live, tmp_path)
    tape.begin()
    tape.begin()  # a second record leaves the first one
    assert sorted(file.name for file in tmp_path.iterdir()) == [
        f"{live.task.name}_{k}.{kind}" for k in (1, 2) for kind in ("jsonl", "toml")
    ]
    file = tape.file
    tape.end()
    file.write_text('{"time": 0.1, "hold": true}\n')
    scene = load_scene(file.with_suffix(".toml"))
    assert scene.task.motion.goals == ()
    assert scene.task.simulation == live.task.simulation
    assert np.array_equal(Site(scene).start, site.start)
