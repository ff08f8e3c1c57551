"""Whatever `MUJOCO_GL` says: models are built, and pictures are made or their want has the true cause."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.long

PROGRAM = """
import sys
from pathlib import Path

import vgtsim.errors
from vgtsim.cli import main
from vgtsim.output.stage import Stage, compile_view

sys.argv = ["vgtsim", "build", "arm9", "--out", sys.argv[1]]
try:
    main()
except SystemExit as ended:
    print("built", ended.code or 0)
site = vgtsim.load("arm9_nullspace")
try:
    Stage(site, compile_view(site), (64, 64), 1.0).close()
    print("drawn")
except vgtsim.errors.MissingLibraryError as missing:
    print(missing)
"""
HERE = "set MUJOCO_GL=egl, or unset it, before the program starts"


def start(program, *arguments, **environment):
    """A program in a process of its own, on a machine without a display."""
    kept = {key: value for key, value in os.environ.items() if key not in ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY")}
    return subprocess.run(
        [sys.executable, "-W", "ignore", "-c", program, *map(str, arguments)],
        env=kept | environment,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(
    ("value", "causes"),
    [
        ("", ("drawn", "EGL is missing; install it with: apt-get install libegl1 libgl1-mesa-dri")),
        ("osmesa", ("drawn", "OSMesa, which MUJOCO_GL=osmesa asks for, is missing; install it with: apt-get install")),
        ("glfw", (f"a display is missing; {HERE}",)),
        ("off", (f"a way of drawing, since MUJOCO_GL=off turns it off, is missing; {HERE}",)),
        ("Opengl", (f"a way of drawing with the name 'opengl', which MUJOCO_GL gives, is missing; {HERE}",)),
    ],
)
@pytest.mark.skipif(sys.platform != "linux", reason="the ways of drawing are those of Linux")
def test_a_way_of_drawing_that_is_not_there_stops_pictures_alone(value, causes, tmp_path):
    done = start(PROGRAM, tmp_path, MUJOCO_GL=value)
    *_, built, drawn = done.stdout.splitlines() or [done.stderr, ""]
    assert built == "built 0", done.stderr
    assert drawn.startswith(causes)
    assert (tmp_path / "arm9.xml").is_file()


@pytest.mark.parametrize("value", ["", "Opengl"])
def test_the_viewer_without_a_display_ends_with_the_status_of_a_missing_library(value):
    program = "import sys; sys.argv = ['vgtsim', 'view', 'arm9']; from vgtsim.cli import main; main()"
    done = start(program, MUJOCO_GL=value)
    assert done.returncode == 4, done.stderr
    assert "a display" in done.stderr
    assert "vgtsim render" in done.stderr


def test_a_device_of_egl_that_does_not_exist_is_named(tmp_path):
    done = start(PROGRAM, tmp_path, MUJOCO_GL="egl", MUJOCO_EGL_DEVICE_ID="none")
    assert "invalid literal for int() with base 10: 'none'" in done.stdout
