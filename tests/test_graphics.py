"""Whatever `MUJOCO_GL` says: models are built, and pictures are made or their want has the true cause."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.long

PROGRAM = """
import os
import sys

import vgtsim.errors
from vgtsim.cli import main

def call(*words):
    sys.argv = ["vgtsim", *words]
    try:
        main()
    except SystemExit as ended:
        return ended.code or 0
    return 0

def make(folder):
    print("built", call("build", "arm9", "--out", folder))
    from vgtsim.output.stage import Stage, compile_view
    try:
        Stage(site, compile_view(site), (64, 64), 1.0).close()
        print("drawn")
    except vgtsim.errors.MissingLibraryError as missing:
        print(missing)
    return 0

def become(value, task, folder):  # a child, which imports MuJoCo with its own variable
    os.environ["MUJOCO_GL"] = value
    if task == "device":
        os.environ["MUJOCO_EGL_DEVICE_ID"] = "none"
    for stream, name in ((1, "printed"), (2, "complained")):
        os.dup2(os.open(f"{folder}/{name}", os.O_WRONLY | os.O_CREAT), stream)
    status = 99
    try:
        status = call("view", "arm9") if task == "view" else make(folder)
        sys.stdout.flush()
    finally:
        os._exit(status)

site = vgtsim.load("arm9_nullspace")
_, place, *tasks = sys.argv
call("check", "arm9")  # loads all else that is needed
assert "mujoco" not in sys.modules
for word in tasks:
    folder = os.path.join(place, word)
    os.mkdir(folder)
    if os.fork() == 0:
        become(*word.split("-"), folder)
    with open(f"{folder}/status", "w") as file:
        file.write(str(os.waitstatus_to_exitcode(os.wait()[1])))
"""
HERE = "set MUJOCO_GL=egl, or unset it, before the program starts"


CAUSES = {
    "": ("drawn", "EGL is missing; install it with: apt-get install libegl1 libgl1-mesa-dri"),
    "osmesa": ("drawn", "OSMesa, which MUJOCO_GL=osmesa asks for, is missing; install it with: apt-get install"),
    "glfw": (f"a display is missing; {HERE}",),
    "off": (f"a way of drawing, since MUJOCO_GL=off turns it off, is missing; {HERE}",),
    "Opengl": (f"a way of drawing with the name 'opengl', which MUJOCO_GL gives, is missing; {HERE}",),
}
VIEWERS = ("", "Opengl")


@pytest.fixture(scope="module")
def ends(tmp_path_factory):
    """Folder of what children of one warm process left, each with its own variable, on a machine without a display."""
    folder = tmp_path_factory.mktemp("ends")
    tasks = (*(f"{value}-make" for value in CAUSES), *(f"{value}-view" for value in VIEWERS), "egl-device")
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", PROGRAM, folder, *tasks],
        env={key: value for key, value in os.environ.items() if key not in ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize(("value", "causes"), CAUSES.items())
@pytest.mark.skipif(sys.platform != "linux", reason="the ways of drawing are those of Linux")
def test_a_way_of_drawing_that_is_not_there_stops_pictures_alone(value, causes, ends):
    folder = ends / f"{value}-make"
    *_, built, drawn = (folder / "printed").read_text().splitlines() or ["", ""]
    assert built == "built 0", (folder / "complained").read_text()
    assert drawn.startswith(causes)
    assert (folder / "arm9.xml").is_file()


@pytest.mark.parametrize("value", VIEWERS)
def test_the_viewer_without_a_display_ends_with_the_status_of_a_missing_library(value, ends):
    folder = ends / f"{value}-view"
    said = (folder / "complained").read_text()
    assert (folder / "status").read_text() == "4", said
    assert "a display" in said
    assert "vgtsim render" in said


def test_a_device_of_egl_that_does_not_exist_is_named(ends):
    assert "invalid literal for int() with base 10: 'none'" in (ends / "egl-device/printed").read_text()
