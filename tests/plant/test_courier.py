"""Work beside the steps: its order, that it is beside them, and its errors."""

from __future__ import annotations

from threading import Event, get_ident

import pytest

from vgtsim.plant.recorder import Courier


def test_work_is_done_in_order_in_another_thread():
    courier, done = Courier(), []
    for number in range(20):
        courier.send(lambda number=number: done.append((number, get_ident())))
    courier.wait()
    assert [number for number, _ in done] == list(range(20))
    assert get_ident() not in {thread for _, thread in done}


def test_the_caller_goes_on_while_work_is_done():
    courier, gone_on = Courier(), Event()
    seen = []
    courier.send(lambda: seen.append(gone_on.wait(30)))
    gone_on.set()
    courier.wait()
    assert seen == [True]


def test_an_error_is_raised_once_and_keeps_the_next_work_back():
    courier, done = Courier(), []

    def fail() -> None:
        raise OSError("disk full")

    courier.send(fail)
    with pytest.raises(OSError, match="disk full"):
        courier.send(lambda: done.append("after"))
    courier.wait()
    assert done == []
