"""The end of a program."""

from __future__ import annotations

import atexit
import gc
import sys


def end_at_once() -> None:
    """Let the end of this process look for no garbage: in compiled code that takes up to half a second."""
    atexit.register(_keep_all)


def _keep_all() -> None:
    if "ompl" not in sys.modules:  # its binding would call all that it holds leaked, in fifty lines
        gc.freeze()
