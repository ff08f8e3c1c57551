"""One piece of work at a time in a second thread, while the arm is stepped: a log is made and written beside the steps."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor


class Courier:
    """Takes work, and does it in the order in which it is given; the thread starts with the first work.

    MuJoCo, NumPy, Arrow and the disk let other threads go on, so two cores are used where there are two.
    """

    def __init__(self) -> None:
        """Have nothing to do."""
        self._thread: ThreadPoolExecutor | None = None
        self._sent: Future[None] | None = None

    def send(self, work: Callable[[], None]) -> None:
        """Give work, once what was given before is done; an error of that is raised, and the work is not taken then."""
        self.wait()
        self._thread = self._thread or ThreadPoolExecutor(1, "log")
        self._sent = self._thread.submit(work)

    def wait(self) -> None:
        """Wait until nothing is under way; an error of the last work is raised once."""
        sent, self._sent = self._sent, None
        if sent is not None:
            sent.result()
