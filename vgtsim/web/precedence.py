"""How a live arm comes before other programs of its machine, as the control loops of robots do, where the system permits it."""

from __future__ import annotations

import gc
import os
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress

SERVER, LOOP = 1, 2  # real-time priorities, the lowest: of the page's server, and of the loop, which it never holds up
_CORES = 2  # with one core, a loop that is too slow for its clock would leave nothing to anybody


@contextmanager
def take_precedence(priority: int, threads: Sequence[threading.Thread] | None = None) -> Iterator[bool]:
    """Let threads, by default the one that asks, run before all that is not real-time; the result tells whether they do.

    It needs Linux, two cores, and the right to real-time priorities; without them nothing changes. Programs that the thread
    begins do not inherit its priority. What is in memory now is not looked through for garbage meanwhile: that takes up to
    tenths of a second.
    """
    gc.collect()
    gc.freeze()
    asked = [threading.current_thread()] if threads is None else threads
    raised = [native for thread in asked if (native := thread.native_id) is not None and _raise(native, priority)]
    try:
        yield bool(raised)
    finally:
        for native in raised:
            with suppress(OSError):  # the thread has ended
                os.sched_setscheduler(native, os.SCHED_OTHER | os.SCHED_RESET_ON_FORK, os.sched_param(0))
        gc.unfreeze()


def _raise(native: int, priority: int) -> bool:
    if not hasattr(os, "sched_setscheduler") or len(os.sched_getaffinity(0)) < _CORES:
        return False
    if os.sched_getscheduler(native) & ~os.SCHED_RESET_ON_FORK != os.SCHED_OTHER:
        return False  # the person who began the program has chosen for it
    try:
        os.sched_setscheduler(native, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
    except OSError:
        return False
    return True
