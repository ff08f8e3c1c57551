"""Choose how MuJoCo draws, then import MuJoCo.

MuJoCo reads `MUJOCO_GL` when it is first imported. This package draws through EGL where the library is there, and
otherwise not at all: MuJoCo then still simulates. A value that the user has set stays. Every room that uses MuJoCo
imports this module first, so `import vgtsim` alone changes nothing.
"""

from __future__ import annotations

import ctypes
import os
import sys


def _choose_graphics() -> None:
    if "MUJOCO_GL" in os.environ or "mujoco" in sys.modules:
        return
    try:
        ctypes.CDLL("libEGL.so.1")
    except OSError:
        os.environ["MUJOCO_GL"] = "disable"  # MuJoCo fails at import if it is told to use EGL and there is none
    else:
        os.environ["MUJOCO_GL"] = "egl"


_choose_graphics()

import mujoco as mujoco  # noqa: E402  after the choice
