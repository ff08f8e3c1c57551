"""The film of a run: the logged poses, members coloured by axial force, drawn offscreen."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import closing, contextmanager
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.judging import Cut
from vgtsim.errors import MissingLibraryError
from vgtsim.graphics import mujoco
from vgtsim.kinematics.ties import first_greatest
from vgtsim.mjcf import build_model, names, tank
from vgtsim.output.colours import scale_end
from vgtsim.output.overlay import Mark, draw_overlay, make_overlay
from vgtsim.output.quantities import MINUS, format_quantity
from vgtsim.output.replay import camera_at, frame_times, interpolate, make_replay, pose_model, project
from vgtsim.replacing import replacing
from vgtsim.runlog import RunLog
from vgtsim.site import Site
from vgtsim.verification import Report, goal_name

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

_DIM = 0.6
_AMBIENT, _DIFFUSE = 0.4, 0.35  # together just above one: no colour saturates
_SLICES, _STACKS = 14, 6  # of a round geom, a few pixels wide; finer ones take most of a frame's time
_INSIDE = ("riser", "tool")
_ENCODER = ["-preset", "veryfast", "-movflags", "+faststart"]
_QUALITY = 6  # of ten; constant rate factor 20


def render_video(
    site: Site,
    log: RunLog,
    report: Report,
    path: str | Path,
    progress: Callable[[int, int], None] | None = None,
    cuts: tuple[Cut, ...] | None = None,
) -> None:
    """Film a run to an MP4 file (H.264), whole or not at all, in the size and speed of the scene's `video` table.

    The film shows the report's series `tool_position_error`, if tracking was measured. `progress` is called with the
    frames drawn and their number; the cuts may take the place of the scene's.

    Raises:
        MissingLibraryError: There is no EGL or no encoder.
        OSError: The folder cannot be written, or the encoder stopped.
    """
    video = site.task.video
    width, height = video.width // 2 * 2, video.height // 2 * 2  # 4:2:0 halves both
    times = frame_times(log, video.fps, video.speed)
    frames = draw_frames(site, log, report, times, (width, height), cuts or video.cuts)
    with closing(frames), replacing(path) as partial:
        first = next(frames)  # before the encoder starts: without EGL it would have nothing to do
        with _open_film(partial, width, height, video.fps) as add:
            for drawn, frame in enumerate(chain([first], frames), start=1):
                add(frame)
                if progress:
                    progress(drawn, len(times))


def draw_frames(
    site: Site, log: RunLog, report: Report, times: Array, size: tuple[int, int], cuts: tuple[Cut, ...]
) -> Generator[Picture, None, None]:
    """Draw the run at given times, shape (F,), s, in frames of shape (height, width, 3); see `render_video`.

    Raises:
        MissingLibraryError: There is no EGL.
    """
    width, height = size
    axial = log.axial(site.truss.ends)
    model = _compile(site)
    replay = make_replay(model, site.truss, scale_end(axial))
    overlay = make_overlay(width, height, site.task.title, replay.end)
    goals = np.array([goal.position for goal in site.task.motion.goals])
    with _open_renderer(model, width, height) as renderer:
        for time in times:
            record, nodes, forces = interpolate(log, axial, float(time))
            pose_model(replay, nodes, forces)
            camera = camera_at(cuts, float(time))
            renderer.update_scene(replay.data, camera, _choose_groups(camera))
            renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
            renderer.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
            values = _values(site, log, report, record, float(time), forces)
            places = project(renderer.scene, goals, width, height).tolist()
            marks = tuple(
                Mark(text=goal.name, column=column, row=row, active=index == log.goal[record])
                for index, (goal, (column, row)) in enumerate(zip(site.task.motion.goals, places, strict=True))
            )
            yield draw_overlay(overlay, renderer.render(), values, marks)


def _compile(site: Site) -> mujoco.MjModel:
    """Compile the scene for the eye: light that keeps colours, and a liner darker than the members."""
    model = build_model(site)
    model.mat(f"{names.TANK}/liner").rgba[:3] *= _DIM
    model.vis.headlight.ambient, model.vis.headlight.diffuse = [_AMBIENT] * 3, [_DIFFUSE] * 3
    model.light_diffuse[:] = _DIFFUSE
    model.vis.quality.numslices, model.vis.quality.numstacks = _SLICES, _STACKS
    return model


def _choose_groups(camera: str) -> mujoco.MjvOption:
    """Hide the front half of the tank from the cameras outside it."""
    view = mujoco.MjvOption()
    view.geomgroup[[tank.FRONT_GROUP, tank.FRONT_COVER_GROUP]] = camera in _INSIDE
    return view


def _values(site: Site, log: RunLog, report: Report, record: int, time: float, forces: Array) -> tuple[str, ...]:
    """Write the texts of one instant, one for each of the overlay's labels."""
    goal = goal_name(site, int(log.goal[record])) or "none"
    error = report.series.get("tool_position_error")
    worst = int(first_greatest(np.abs(forces)))
    return (
        f"{time:.2f} s",
        f"{goal}{' (settled)' if log.settled[record] else ''}",
        format_quantity(float(error[record]), "m") if error is not None and np.isfinite(error[record]) else "",
        f"{forces[worst] / 1e3:+.1f} kN".replace("-", MINUS),
        site.truss.members[worst].name,
    )


@contextmanager
def _open_renderer(model: mujoco.MjModel, width: int, height: int) -> Iterator[mujoco.Renderer]:
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    try:
        renderer = mujoco.Renderer(model, height, width)
    except (ImportError, AttributeError, RuntimeError, mujoco.FatalError):
        # which of them depends on what is missing: the library, its driver, or a device
        raise MissingLibraryError("EGL", "apt-get install libegl1 libgl1-mesa-dri") from None
    try:
        yield renderer
    finally:
        renderer.close()


@contextmanager
def _open_film(path: Path, width: int, height: int, fps: int) -> Iterator[Callable[[Picture], None]]:
    """Open an MP4 file; give a function that appends a frame, shape (height, width, 3), of even sizes."""
    try:
        import imageio_ffmpeg

        imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        raise MissingLibraryError("the ffmpeg encoder", "pip install imageio[ffmpeg]") from None
    pipe = imageio_ffmpeg.write_frames(
        str(path),
        (width, height),
        fps=fps,
        codec="libx264",
        pix_fmt_out="yuv420p",
        macro_block_size=2,
        quality=_QUALITY,
        ffmpeg_log_level="error",
        output_params=_ENCODER,
    )
    pipe.send(None)
    try:
        yield lambda frame: pipe.send(np.ascontiguousarray(frame))
    finally:
        pipe.close()
