"""The film: a file that plays, frames in which things can be made out, and clear errors without it."""

import dataclasses
import re
import subprocess
from contextlib import closing
from types import SimpleNamespace

import imageio_ffmpeg
import mujoco
import numpy as np
import pytest

from vgtsim.description.judging import Cut, Video
from vgtsim.errors import DescriptionError, MissingLibraryError
from vgtsim.output import stage as stage_module
from vgtsim.output import video
from vgtsim.output.overlay import Mark, draw_overlay, make_overlay
from vgtsim.output.quantities import format_quantity
from vgtsim.output.readings import read_instant
from vgtsim.output.stage import Stage, compile_view
from vgtsim.output.video import draw_frames, render_runs
from vgtsim.output.write import film, write_outputs
from vgtsim.site import Site
from vgtsim.verification import JudgedRun

WIDTH, HEIGHT, FPS = 320, 180, 5
SPEED = 60.0  # two minutes of run in two seconds of film
SHARE = 0.002  # of the picture's pixels; the arm covers more
RADIUS = 4  # pixels about a goal in which its ball must be seen


def set_video(scene, **settings):
    return Site(dataclasses.replace(scene, task=scene.task.model_copy(update={"video": Video(**settings)})))


@pytest.fixture(scope="module")
def small(scene):
    cuts = (Cut(camera="overview", until=40.0), Cut(camera="cutaway"))
    return set_video(scene, width=WIDTH + 1, height=HEIGHT, fps=FPS, speed=SPEED, cuts=cuts)


@pytest.mark.long
@pytest.mark.render
@pytest.mark.usefixtures("egl")
def test_film_is_h264_of_the_size_and_length_asked_for(small, log, report, tmp_path):
    calls = []
    render_runs([JudgedRun(small, log, report)], tmp_path / "video.mp4", lambda *done: calls.append(done))
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(tmp_path / "video.mp4"), "-f", "null", "-"]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stderr
    stream = next(line for line in told.splitlines() if "Video: h264" in line)
    assert "yuv420p" in stream
    assert f" {WIDTH}x{HEIGHT}" in stream  # the odd column is dropped
    assert f" {FPS} fps" in stream
    wanted = int(log.time[-1] / SPEED * FPS) + 1
    assert int(re.findall(r"frame=\s*(\d+)", told)[-1]) == wanted
    assert calls == [(done, wanted) for done in range(1, wanted + 1)]
    assert [file.name for file in tmp_path.iterdir()] == ["video.mp4"]


@pytest.mark.long
@pytest.mark.render
@pytest.mark.usefixtures("egl")
def test_members_turn_from_blue_to_red_with_the_sign_of_their_force(site, log, report):
    direction = log.directions(site.truss.ends)
    near = set_video(site.scene, cuts=(Cut(camera="riser"),))
    seen = []
    for force in (3e5, -3e5):
        pushed = dataclasses.replace(log, member_force=force * direction)
        (frame,) = draw_frames(JudgedRun(near, pushed, report), np.array([0.0]), (WIDTH, HEIGHT), near.task.video.cuts)
        seen.append(frame[:, : 3 * WIDTH // 4].astype(int))  # without the scale bar
    tension, compression = seen
    changed = np.abs(tension - compression).max(axis=-1) > 40
    assert changed.mean() > SHARE
    assert (tension[changed][:, 2] > tension[changed][:, 0]).mean() > 0.95
    assert (compression[changed][:, 0] > compression[changed][:, 2]).mean() > 0.95


@pytest.mark.long
@pytest.mark.render
@pytest.mark.usefixtures("egl")
def test_goal_markers_are_seen_where_they_project(small, log):
    with closing(Stage(small, compile_view(small), (1280, 720), 1.0)) as stage:
        picture, places = stage.draw("cutaway", log.nodes[0], log.axial(small.truss.ends)[0]).result()
    frame = picture.astype(int)
    green = (frame[..., 1] > frame[..., 0] + 30) & (frame[..., 1] > frame[..., 2] + 30)
    for column, row in np.round(places[: len(small.task.motion.goals)]).astype(int):
        assert green[row - RADIUS : row + RADIUS, column - RADIUS : column + RADIUS].any()


@pytest.mark.long
@pytest.mark.render
@pytest.mark.usefixtures("egl")
def test_a_failure_half_way_leaves_no_file(small, log, report, tmp_path):
    def stop(done, _):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        render_runs([JudgedRun(small, log, report)], tmp_path / "video.mp4", stop)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_without_egl_the_package_is_named_and_the_rest_is_written(small, log, report, tmp_path, monkeypatch):
    def refuse(*_):
        raise ImportError("Cannot initialize a EGL device display")

    monkeypatch.setattr(mujoco, "GLContext", refuse)
    missing = write_outputs(small, log, report, tmp_path, video=True)
    assert isinstance(missing, MissingLibraryError)
    assert missing.needed == "EGL (Cannot initialize a EGL device display)"
    assert "libegl1" in missing.package
    assert sorted(file.name for file in tmp_path.iterdir()) == ["log", "report.html", "report.json"]


def test_without_an_encoder_the_package_is_named(small, log, report, tmp_path, monkeypatch):
    def refuse():
        raise RuntimeError("No ffmpeg exe could be found")

    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", refuse)
    with pytest.raises(MissingLibraryError, match="imageio"):
        render_runs([JudgedRun(small, log, report)], tmp_path / "video.mp4")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
@pytest.mark.render
@pytest.mark.usefixtures("egl")
def test_one_camera_can_be_asked_for(small, log, report, tmp_path, monkeypatch):
    seen = []
    draw = Stage.draw
    monkeypatch.setattr(Stage, "draw", lambda stage, *what: seen.append(what[0]) or draw(stage, *what))
    assert film(small, log, report, tmp_path, "riser") == tmp_path / "video.mp4"
    assert set(seen) == {"riser"}


def test_a_camera_that_does_not_exist_is_named_with_the_nearest(small, log, report, tmp_path):
    with pytest.raises(DescriptionError, match="did you mean 'cutaway'"):
        film(small, log, report, tmp_path, "cutawya")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (640, 360), (320, 180), (1920, 1080)])
def test_texts_and_scale_stay_inside_the_picture_and_apart(width, height):
    overlay = make_overlay(width, height, "title", 4.2e5)
    longest = (
        "120.00 s (2.5 times)",
        "a_long_goal_name (settled)",
        "12.3 mm to goal",
        "+417.0 kN",
        "m10/cross_longeron/3",
    )
    black = np.zeros((height, width, 3), np.uint8)
    for column, row in overlay.values:
        assert column < width
        assert row + overlay.unit < height
    written = draw_overlay(overlay, black, longest, ())
    plain = draw_overlay(overlay, black, ("",) * 5, ())
    changed = (written != plain).any(axis=-1)
    assert changed.any()
    assert plain[:, -5 * overlay.unit :].any()
    assert not changed[:, -8 * overlay.unit :].any()  # no value runs into the scale bar


def test_texts_tell_the_way_to_the_goal_and_the_error_there(small, log, report):
    settled, moving = int(np.flatnonzero(log.settled)[0]), int(np.flatnonzero(~log.settled & (log.goal >= 0))[0])
    axial = log.axial(small.truss.ends)
    tiny = dataclasses.replace(report, series=dict(report.series) | {"tool_position_error": np.full(log.count, 1e-11)})
    texts = [
        read_instant(JudgedRun(small, log, told), k, axial[k])
        for told, k in ((report, moving), (report, settled), (tiny, settled))
    ]
    limit = small.task.limits.tracking_position
    shown = f"{format_quantity(float(report.series['tool_position_error'][moving]), 'm')} to goal"
    assert [text[1].split()[-1] for text in texts] == ["goal", "off", "off"]
    assert texts[0][1] == shown
    assert texts[2][1] == f"{format_quantity(1e-3 * limit, 'm')} off"


@pytest.mark.long
@pytest.mark.render
@pytest.mark.usefixtures("egl")
def test_the_near_wall_is_a_ghost_from_outside_and_solid_from_inside(small, log):
    axial = log.axial(small.truss.ends)[0]
    with closing(Stage(small, compile_view(small), (WIDTH, HEIGHT), 1.0)) as stage:
        seen = {}
        for opacity in (stage_module._GHOST[3], 0.0):
            stage._grounds.clear()
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(stage_module, "_GHOST", (*stage_module._GHOST[:3], opacity))
                for camera in ("cutaway", "tool"):
                    picture, _ = stage.draw(camera, log.nodes[0], axial).result()
                    seen[camera, opacity > 0] = picture.astype(int)
    changed = {camera: np.abs(seen[camera, True] - seen[camera, False]).max(axis=-1) for camera in ("cutaway", "tool")}
    assert (changed["cutaway"] > 2).mean() > 0.2  # of the picture is behind the near wall
    assert changed["cutaway"].max() < 90  # and is seen through it
    assert not changed["tool"].any()


def test_marks_outside_the_picture_are_left_out():
    overlay = make_overlay(WIDTH, HEIGHT, "", 1.0, ("far", "behind", "near"))
    black = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    values = ("",) * 5
    far = (Mark("far", -50.0, 3.0, False), Mark("behind", float("nan"), float("nan"), False))
    np.testing.assert_array_equal(draw_overlay(overlay, black, values, far), draw_overlay(overlay, black, values, ()))
    near = (Mark("near", WIDTH / 2, HEIGHT / 2, True),)
    assert (draw_overlay(overlay, black, values, near) != draw_overlay(overlay, black, values, ())).any()


@pytest.mark.long
@pytest.mark.render
@pytest.mark.usefixtures("egl")
def test_frames_are_the_same_for_any_number_of_cores(small, log, report, monkeypatch):
    times = np.linspace(0.0, 80.0, 7)  # of both cameras
    films = []
    for count in (1, 3):
        monkeypatch.setattr(video, "_count_stages", lambda count=count: count)
        films.append(list(draw_frames(JudgedRun(small, log, report), times, (WIDTH, HEIGHT), small.task.video.cuts)))
    np.testing.assert_array_equal(*films)


def test_a_scene_that_stands_still_is_drawn_once_and_nothing_that_shows_is_left_out(log):
    nodes, axial = log.nodes[0], np.zeros(5)
    here = video._Instant(0.0, 0, "cutaway", nodes, axial)
    creeps = [dataclasses.replace(here, time=k, nodes=nodes + k * 0.4 * video._STILL) for k in range(4)]
    brightens = dataclasses.replace(creeps[3], axial=axial + 3 * video._SHADE)
    elsewhere = dataclasses.replace(brightens, camera="riser")
    drawn = []
    hands = [SimpleNamespace(draw=lambda *_, hand=hand: drawn.append(hand) or len(drawn)) for hand in "ab"]
    shown = list(video._share(iter([here, *creeps, brightens, brightens, elsewhere]), hands, 1.0))
    assert [now.time for now, _ in shown] == [0.0, 0, 1, 2, 3, 3, 3, 3]
    # the last creep has left the place that was drawn, though each is near the one before
    assert [drawing for _, drawing in shown] == [1, 1, 1, 1, 2, 3, 3, 4]
    assert drawn == ["a", "b", "a", "b"]
