"""The part of a study that its workers do: cases to rows."""

from __future__ import annotations

import time
from functools import lru_cache
from typing import Any

from vgtsim.description import Scene, change_entries, parse_scene
from vgtsim.site import Site
from vgtsim.study.cases import Case, Order, join_scene, list_versions, split_scene
from vgtsim.study.verbs import VERBS, Found

Row = dict[str, Any]


def work_off(order: Order, cases: tuple[Case, ...]) -> list[Row]:
    """Do some cases, one after the other; each is a row, that of a case which failed too.

    Raises:
        ImportError: This worker has other versions of the packages than the study was begun with.
    """
    if (here := list_versions()) != order.versions:
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
