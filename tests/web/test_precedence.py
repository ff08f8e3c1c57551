"""Real-time priority of loop and server: taken while they run where the system permits it, and given back."""

from __future__ import annotations

import os
import subprocess
import sys
import threading

import pytest

pytest.importorskip("viser")

from vgtsim.web.precedence import LOOP, SERVER, take_precedence

pytestmark = pytest.mark.skipif(not hasattr(os, "sched_setscheduler"), reason="only Linux tells and sets them")

TELL = "import os; print(os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK)"


def find_policy(native=0):
    return os.sched_getscheduler(native) & ~os.SCHED_RESET_ON_FORK, os.sched_getparam(native).sched_priority


def is_permitted():
    """Whether a program of its own may do it."""
    ask = "import os; os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(2))"
    return subprocess.run([sys.executable, "-c", ask], stderr=subprocess.DEVNULL, check=False).returncode == 0


def test_a_thread_comes_first_while_it_asks_and_its_children_do_not():
    if len(os.sched_getaffinity(0)) < 2 or not is_permitted():
        pytest.skip("the system does not permit it")
    with take_precedence(LOOP) as first:
        assert first
        assert find_policy() == (os.SCHED_FIFO, LOOP)
        child = subprocess.run([sys.executable, "-c", TELL], capture_output=True, text=True, check=True)
    assert int(child.stdout) == os.SCHED_OTHER
    assert find_policy() == (os.SCHED_OTHER, 0)
    stop = threading.Event()
    other = threading.Thread(target=stop.wait)
    other.start()
    with take_precedence(SERVER, [other]) as first:
        assert first
        assert find_policy(other.native_id or 0) == (os.SCHED_FIFO, SERVER)
        assert find_policy() == (os.SCHED_OTHER, 0)
        stop.set()
        other.join()  # a thread that ends meanwhile is no error


@pytest.mark.parametrize("why", ["one core", "not permitted", "chosen by the person"])
def test_without_permission_nothing_changes_and_nothing_is_said(monkeypatch, capfd, why):
    asked = []

    def refuse(*args):
        asked.append(args)
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0} if why == "one core" else {0, 1})
    if why == "chosen by the person":
        monkeypatch.setattr(os, "sched_getscheduler", lambda _: os.SCHED_BATCH)
    with take_precedence(LOOP) as first:
        assert not first
    assert bool(asked) == (why == "not permitted")
    assert capfd.readouterr() == ("", "")
