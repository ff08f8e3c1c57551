"""Where cases are worked off: processes of this machine, or the workers of a Dask cluster.

Processes are those of `concurrent.futures`: it stands in the standard library, and joblib or loky would add nothing, as
`dispatch` needs the loss of a worker reported, not hidden.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from vgtsim.ending import end_at_once
from vgtsim.errors import ClusterError, MissingLibraryError

INSTALL = "pip install 'vgtsim[study]'"
_PATIENCE = 5.0  # s for a process to end before it is killed
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_ENOUGH = 2  # pieces for a process, which takes a second to start
_AHEAD = 4096  # batches that a cluster has at a time: some for each of a thousand cores
_BATCH_S = 10.0  # a scheduler takes milliseconds for a batch: a thousand cores then ask for a hundred of them a second


@dataclass(frozen=True)
class Engine:
    """Gives executors of a place; `width` batches are under way at a time, those of short cases with `batch_s` of work each, s.

    `lost` are the errors of a batch whose worker was lost. After a `BrokenExecutor` a new executor is opened.
    """

    place: str
    open: Callable[[], Executor]
    width: int
    lost: tuple[type[BaseException], ...]
    batch_s: float = 1.0


def count_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def use_processes(workers: int) -> Iterator[Engine]:
    """Work in that many processes of this machine, each on one thread; two batches are under way for each."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))  # inherited: it must be there before a process imports NumPy
    context, others = multiprocessing.get_context("spawn"), set(multiprocessing.active_children())
    opened: list[Executor] = []

    def start() -> Executor:
        opened.append(ProcessPoolExecutor(workers, mp_context=context, initializer=_settle))
        return opened[-1]

    try:
        yield Engine("of this machine", start, 2 * workers, (BrokenExecutor,))
    finally:
        for pool in opened:
            pool.shutdown(wait=False, cancel_futures=True)
        left = set(multiprocessing.active_children()) - others
        for process in left:
            process.terminate()
        for process in left:
            process.join(_PATIENCE)
            if process.is_alive():
                process.kill()
                process.join()
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


def _settle() -> None:
    """Make a process silent, and end it with the one that started it, even if that is killed."""
    end_at_once()
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115  no progress bars; it lives as long as the process
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=lambda: (parent.join(), os._exit(1)), daemon=True).start()


@contextmanager
def use_cluster(address: str) -> Iterator[Engine]:
    """Work on the workers of the Dask scheduler at an address such as "tcp://host:8786".

    Raises:
        MissingLibraryError: Dask's `distributed` is not installed.
        ClusterError: No scheduler answers there.
    """
    try:
        from distributed import Client
        from distributed.scheduler import KilledWorker
    except ImportError:
        raise MissingLibraryError("distributed", INSTALL) from None
    try:
        client = Client(address, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ClusterError(address, f"no scheduler answers: {error}") from None
    with client:
        yield Engine(address, lambda: client.get_executor(pure=False), _AHEAD, (KilledWorker,), _BATCH_S)


@contextmanager
def spread_out(pieces: int) -> Iterator[Callable[..., Iterable[Any]]]:
    """Give `map`, or one that works in processes if there are enough pieces, of a second or more each, and cores for them."""
    workers = min(count_cores(), pieces // _ENOUGH)
    if workers < 2:
        yield map
        return
    with use_processes(workers) as engine:
        yield engine.open().map
