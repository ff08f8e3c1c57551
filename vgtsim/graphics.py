"""Choose how MuJoCo draws, then import MuJoCo.

MuJoCo reads `MUJOCO_GL` when it is first imported. Where that is not set, or names no way of drawing, this package draws
through EGL on Linux if the library is there, and otherwise not at all. A way of drawing that the user has set stays, and is not
looked for before something is drawn: MuJoCo fails at its import if the way is unknown or its library is missing, but a
program that only simulates must not. Every room that uses MuJoCo imports this module first, so `import vgtsim` alone changes
nothing.
"""

from __future__ import annotations

import ctypes
import os
import sys
import warnings

from vgtsim.errors import MissingLibraryError

_KEY = "MUJOCO_GL"
# MuJoCo would open a window, which a machine without a display lacks
_ANY = ("", "enable", "enabled", "on", "true", "1")
_NONE = ("disable", "disabled", "off", "false", "0")
_EGL = ("EGL", "apt-get install libegl1 libgl1-mesa-dri")
_REMEDY = "set MUJOCO_GL=egl, or unset it, before the program starts"


def _given() -> str:
    return os.environ.get(_KEY, "").strip().lower()


def _has_egl() -> bool:
    try:
        ctypes.CDLL("libEGL.so.1")
    except OSError:
        return False
    return True


def _import_first() -> bool:
    """Import MuJoCo with a way of drawing; says if the package itself has turned drawing off, for want of EGL."""
    if "mujoco" in sys.modules:
        return False
    if sys.platform == "linux" and _given() in _ANY:
        os.environ[_KEY] = "egl" if _has_egl() else "disable"
        return os.environ[_KEY] == "disable"
    before = os.environ.get(_KEY)
    try:
        import mujoco
    except Exception:  # of whatever class: MuJoCo lets through what its way of drawing raises
        os.environ[_KEY] = "disable"
        import mujoco  # noqa: F401

        if before is None:
            del os.environ[_KEY]
        else:
            os.environ[_KEY] = before
    return False


_LACKS_EGL = _import_first()

import mujoco as mujoco  # noqa: E402  after the choice


def explain_no_picture(cause: Exception) -> MissingLibraryError:
    """What pictures lack here, by the way of drawing that `MUJOCO_GL` names and the error that it ended with."""
    way = _given()
    detail = f" ({cause})" if isinstance(cause, (ImportError, RuntimeError, ValueError)) and str(cause) else ""
    if way == "egl" or _LACKS_EGL:
        return MissingLibraryError(f"{_EGL[0]}{detail}", _EGL[1])
    if way == "osmesa":
        return MissingLibraryError(f"OSMesa, which MUJOCO_GL=osmesa asks for{detail},", "apt-get install libosmesa6")
    if way in _NONE:
        return MissingLibraryError(f"a way of drawing, since MUJOCO_GL={way} turns it off,", "", _REMEDY)
    if way in (*_ANY, "glfw", "glx") or sys.platform != "linux":
        return MissingLibraryError(f"a display{detail}", "", _REMEDY)
    return MissingLibraryError(f"a way of drawing with the name {way!r}, which MUJOCO_GL gives,", "", _REMEDY)


def require_display() -> None:
    """Open a hidden window and close it again: MuJoCo's viewer ends the whole program where none opens.

    Raises:
        MissingLibraryError: No window opens.
    """
    import glfw

    window = None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the error below says the same
        if glfw.init():
            glfw.window_hint(glfw.VISIBLE, 0)
            window = glfw.create_window(64, 64, "", None, None)
            glfw.default_window_hints()
        _, said = glfw.get_error()
    if not window:
        detail = f" ({said.decode() if isinstance(said, bytes) else said})" if said else ""
        raise MissingLibraryError(
            f"a display{detail}", "", "open the model on a desktop, or film a run with `vgtsim render`"
        )
    glfw.destroy_window(window)
