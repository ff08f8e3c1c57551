"""The loop of a study: cases to workers in batches, what workers do with them, rows back, and workers lost on the way."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from dataclasses import dataclass
from functools import lru_cache
from queue import Empty, SimpleQueue
from typing import Any

from vgtsim.description import Scene, change_entries, parse_scene
from vgtsim.errors import ClusterError
from vgtsim.site import Site
from vgtsim.study.cases import Case, Order, join_scene, list_case_versions, split_scene
from vgtsim.study.engines import Engine
from vgtsim.study.verbs import VERBS, Found

Row = dict[str, Any]

_LARGEST = 1000  # cases of a batch
_BROKEN = "its processes end before the first case does; a program that calls this needs `if __name__ == '__main__':`"
_TICK = 1.0  # s without a row after which `receive` is called all the same: it shows the time that is left
_ALONE = 2  # losses of a worker after which a case goes alone
_BREAKS = 3  # of a pool of processes that has not given one row: it cannot work at all
_CONDEMNED = 2  # losses of a worker by a case that was alone, after which it is the cause


def dispatch(order: Order, cases: Iterable[Case], engine: Engine, receive: Callable[[Sequence[Row]], None]) -> None:
    """Work off cases; `receive` gets the rows of each batch, in the order of arrival, and an empty list now and then.

    The batch of a lost worker is done again. A case that was in hand at several losses is done again alone, so that no
    case is blamed for what another did, and none is lost; one that loses its worker alone, too, is a row with that error.

    Raises:
        ClusterError: The cluster is gone, or a worker cannot begin: it has not the same versions of the packages.
    """
    loop = _Loop(order, engine, deque(cases))
    while loop.fill():
        try:
            rows = loop.collect(_TICK)
        except Empty:
            rows = ()
        receive(rows)


@dataclass(frozen=True)
class _Batch:
    """Cases under way in an executor; `alone` if nothing else was under way."""

    cases: tuple[Case, ...]
    pool: Executor
    alone: bool


class _Loop:
    """Cases that wait, batches under way, and losses so far."""

    def __init__(self, order: Order, engine: Engine, waiting: deque[Case]) -> None:
        self.order, self.engine, self.waiting = order, engine, waiting
        self.pool = engine.open()
        self.suspects: deque[Case] = deque()
        self.running: dict[Future[list[Row]], _Batch] = {}
        self.arrived: SimpleQueue[Future[list[Row]]] = SimpleQueue()
        self.losses: Counter[str] = Counter()
        self.alone: Counter[str] = Counter()
        self.breaks: int | None = 0  # of the pool before its first row
        self.mean_s = engine.batch_s  # of a case, so that the first batches have one each

    def fill(self) -> bool:
        """Send batches until enough are under way; False when all is done."""
        while self.waiting and len(self.running) < self.engine.width:
            share = len(self.waiting) // (2 * self.engine.width)  # the last batches are small, so that all end together
            size = max(min(int(self.engine.batch_s / self.mean_s), _LARGEST, share), 1)
            self._send(tuple(self.waiting.popleft() for _ in range(size)))
        if self.suspects and not self.running:
            self._send((self.suspects.popleft(),), alone=True)
        return bool(self.running)

    def _send(self, cases: tuple[Case, ...], *, alone: bool = False) -> None:
        try:
            future = self.pool.submit(work_off, self.order, cases)
        except BrokenExecutor:  # noticed before one of its futures was
            self._reopen()
            future = self.pool.submit(work_off, self.order, cases)
        self.running[future] = _Batch(cases, self.pool, alone)
        future.add_done_callback(self.arrived.put)

    def _reopen(self) -> None:
        if self.breaks is not None:
            self.breaks += 1
            if self.breaks > _BREAKS:
                raise ClusterError(self.engine.place, _BROKEN)
        self.pool = self.engine.open()

    def collect(self, patience: float) -> list[Row]:
        """Rows of the next batch that arrives, or `queue.Empty` after a while, s."""
        future = self.arrived.get(timeout=patience)
        batch = self.running.pop(future)
        try:
            rows = future.result()
        except self.engine.lost as error:
            if isinstance(error, BrokenExecutor) and batch.pool is self.pool:
                self._reopen()
            return self._resend(batch)
        except CancelledError:
            raise ClusterError(self.engine.place, "the scheduler is gone") from None
        except Exception as error:  # not of a case: those are rows
            raise ClusterError(self.engine.place, f"a worker cannot begin: {str(error).strip()}") from error
        self.breaks = None
        spent = sum(row["processor_s"] for row in rows) / len(rows)
        self.mean_s = max(0.9 * self.mean_s + 0.1 * spent, 1e-4)
        return rows

    def _resend(self, batch: _Batch) -> list[Row]:
        """Line up the cases of a lost batch again; the row of one that is the cause."""
        rows = []
        for case in batch.cases:
            self.losses[case.digest] += 1
            self.alone[case.digest] += batch.alone
            if self.alone[case.digest] >= _CONDEMNED:
                kept: Row = dict.fromkeys(self.order.columns)
                rows.append(make_row(self.order, case, kept, "LostWorker: the case ends its process", 0.0))
            elif self.losses[case.digest] >= _ALONE:
                self.suspects.append(case)
            else:
                self.waiting.appendleft(case)
        return rows


def work_off(order: Order, cases: tuple[Case, ...]) -> list[Row]:
    """Do some cases, one after the other; each is a row, that of a case which failed too.

    Raises:
        ImportError: This worker has other versions of the packages than the study was begun with.
    """
    if (here := list_case_versions()) != order.versions:
        pairs = zip(here, order.versions, strict=True)
        differing = "; ".join(f"{name} {own}, not {other}" for (name, own), (_, other) in pairs if own != other)
        raise ImportError(f"a worker has {differing}: figures of different versions do not mix")
    return [_do_case(order, case) for case in cases]


def _do_case(order: Order, case: Case) -> Row:
    verb = VERBS[order.work.verb]  # pyright: ignore[reportAttributeAccessIssue]
    clock = time.thread_time()
    error = None
    try:
        kept = verb.read(_find(order, case), order.columns)
    except Exception as problem:  # a defect that one case shows must not end the others
        kept, error = dict.fromkeys(order.columns), f"{type(problem).__name__}: {problem}"
    return make_row(order, case, kept, error, time.thread_time() - clock)


def make_row(order: Order, case: Case, kept: Row, error: str | None, seconds: float) -> Row:
    """The row of a case: digest, keys, what is kept, the error if any, and seconds of processor time."""
    return {"digest": case.digest, **order.list_keys(case), **kept, "error": error, "processor_s": seconds}


def _find(order: Order, case: Case) -> Found:
    scene = _read(order.scene)
    changes = dict(zip(order.steps, case.entries, strict=True))
    parts = change_entries(split_scene(scene, order.work), changes, scene.file)
    site = Site(join_scene(scene, parts))
    return VERBS[order.work.verb].do(site, parts["work"], order.folder / "runs" / case.digest)  # pyright: ignore[reportAttributeAccessIssue]


@lru_cache(maxsize=1)
def _read(text: str) -> Scene:
    """The scene of a study, read once a worker."""
    return parse_scene(text)
