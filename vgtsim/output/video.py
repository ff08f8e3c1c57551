"""The film of a run: the logged poses, members coloured by axial force, drawn offscreen."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from itertools import chain, cycle
from pathlib import Path

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import Cut
from vgtsim.errors import MissingLibraryError
from vgtsim.output.colours import scale_end
from vgtsim.output.overlay import LABELS, Mark, Overlay, draw_overlay, make_overlay
from vgtsim.output.readings import name_things, read_instant
from vgtsim.output.replay import camera_at, frame_times, interpolate
from vgtsim.output.stage import Picture, Stage, compile_view, count_appeared
from vgtsim.replacing import replacing
from vgtsim.site import Site
from vgtsim.verification import JudgedRun, find_begins, goal_name

_STILL, _SHADE = 1e-4, 1e-3  # m, and part of the colour scale: a tenth of a pixel, and half a level of a colour
_MOST_STAGES = 4  # more than the texts and the encoder keep up with
_AHEAD = 2  # pictures in work for each stage, so that none waits for the encoder
_ENCODER = ["-preset", "veryfast", "-movflags", "+faststart", "-threads", "1"]  # more threads, other bits
_QUALITY = 6  # of ten; constant rate factor 20


def render_runs(
    runs: Sequence[JudgedRun],
    path: str | Path,
    progress: Callable[[int, int], None] | None = None,
    cuts: tuple[Cut, ...] | None = None,
) -> None:
    """Film one run after the other to an MP4 file (H.264), whole or not at all, as the first scene's `video` table asks.

    The film shows the report's series `tool_position_error`, if tracking was measured. `progress` is called with the
    frames drawn and their number; the cuts may take the place of the scene's.

    Raises:
        MissingLibraryError: There is no EGL or no encoder.
        OSError: The folder cannot be written, or the encoder stopped.
    """
    video = runs[0].site.task.video
    width, height = video.width // 2 * 2, video.height // 2 * 2  # 4:2:0 halves both
    times = [frame_times(run.log, video.fps, video.speed) for run in runs]
    count = sum(map(len, times))
    shown = cuts or video.cuts

    def draw() -> Generator[Picture, None, None]:
        for run, when, begin in zip(runs, times, find_begins(runs), strict=True):
            yield from draw_frames(run, when, (width, height), shown, begin)

    frames = draw()
    with closing(frames), replacing(path) as partial:
        first = next(frames)  # before the encoder starts: without EGL it would have nothing to do
        with _open_film(partial, width, height, video.fps) as add:
            for drawn, frame in enumerate(chain([first], frames), start=1):
                add(frame)
                if progress:
                    progress(drawn, count)


@dataclass(frozen=True)
class _Instant:
    """What a frame shows: the time, s, the record before it, the camera, nodes (N, 3), m, and axial forces (M,), N."""

    time: float
    record: int
    camera: str
    nodes: Array
    axial: Array
    heights: Array | None = None
    here: float = 0.0
    appeared: int = 0

    def repeats(self, other: _Instant, end: float) -> bool:
        """Whether the picture of another instant is this one's too; the colour scale ends at this force, N."""
        still = np.abs(self.nodes - other.nodes).max() < _STILL
        pair = self.heights, other.heights
        dug = pair[0] is not None and pair[1] is not None and bool((pair[0] != pair[1]).any())
        return (
            (self.camera, self.appeared) == (other.camera, other.appeared)
            and still
            and not dug
            and np.abs(self.axial - other.axial).max() < _SHADE * end
        )


def draw_frames(
    run: JudgedRun,
    times: Array,
    size: tuple[int, int],
    cuts: tuple[Cut, ...],
    begin: float = 0.0,
) -> Generator[Picture, None, None]:
    """Draw the run at given times, shape (F,), s, in frames of shape (height, width, 3); see `render_runs`.

    Times are those of the log; cuts are in the film's time, which is the log's plus `begin`, s. The cores share the work; the
    pictures do not depend on the number of cores.

    Raises:
        MissingLibraryError: There is no EGL.
    """
    site, log, axial = run.site, run.log, run.shown.axial
    end = scale_end(axial)
    things = name_things(site)
    goals = [goal.name for goal in site.task.motion.goals]
    overlay = make_overlay(*size, site.task.title, end, goals, things, _list_labels(site))
    instants = (
        _Instant(
            time=begin + float(time),
            record=record,
            camera=camera_at(cuts, begin + float(time)),
            nodes=nodes,
            axial=forces,
            heights=log.bed[record] if log.bed.size else None,
            here=float(time),
            appeared=count_appeared(site.tank, float(time)),
        )
        for time in times
        for record, nodes, forces in [interpolate(log, axial, float(time))]
    )
    with ExitStack() as stack:
        model = compile_view(site)
        stages = [stack.enter_context(closing(Stage(site, model, size, end))) for _ in range(_count_stages())]
        waiting = deque[tuple[_Instant, Future[tuple[Picture, Array]]]]()
        for now, drawing in _share(instants, stages, end):
            waiting.append((now, drawing))
            if len(waiting) > _AHEAD * len(stages):
                yield _label(run, overlay, [*goals, *things], *waiting.popleft())
        while waiting:
            yield _label(run, overlay, [*goals, *things], *waiting.popleft())


def _count_stages() -> int:
    """One for each core, as far as they can be fed."""
    return min(len(os.sched_getaffinity(0)), _MOST_STAGES)


def _share(
    instants: Iterator[_Instant], stages: list[Stage], end: float
) -> Iterator[tuple[_Instant, Future[tuple[Picture, Array]]]]:
    """Give the stages instants to draw, in turns; an instant that repeats the one drawn last shares its picture."""
    turns = cycle(stages)
    shown = next(instants)
    drawing = next(turns).draw(shown.camera, shown.nodes, shown.axial, shown.heights, shown.here)
    for now in chain([shown], instants):
        if not now.repeats(shown, end):
            shown, drawing = now, next(turns).draw(now.camera, now.nodes, now.axial, now.heights, now.here)
        yield now, drawing


def _label(
    run: JudgedRun,
    overlay: Overlay,
    names: list[str],
    now: _Instant,
    drawing: Future[tuple[Picture, Array]],
) -> Picture:
    """Write texts and the names of goals and things of an instant on its picture."""
    site, log = run.site, run.log
    picture, places = drawing.result()
    sought = goal_name(site, int(log.goal[now.record]))
    hidden = {name for name, when in site.tank.appearances.items() if when > now.here}
    named = zip(names, places.tolist(), strict=True)
    marks = tuple(
        Mark(text=name, column=x, row=y, active=name == sought) for name, (x, y) in named if name not in hidden
    )
    speed = site.task.video.speed
    time = f"{now.time:.2f} s" + (f" ({speed:g} times)" if speed != 1 else "")
    texts = (time, *read_instant(run, now.record, now.axial), *_tell_removed(run, now.record))
    if site.tank.appearances:
        texts += (_tell_revision(run, now.here),)
    return draw_overlay(overlay, picture, texts, marks)


def _list_labels(site: Site) -> tuple[str, ...]:
    """Labels of the texts: those of removed waste and of new plans only where there are such."""
    labels = LABELS if site.diggings is None else (*LABELS, "waste removed")
    return (*labels, "planned anew") if site.tank.appearances else labels


def _tell_revision(run: JudgedRun, time: float) -> str:
    """When the tour was planned anew, the last time up to an instant, s."""
    times = [revision.time for revision in run.log.revisions if revision.time <= time]
    return f"at {times[-1]:.2f} s" if times else "not yet"


def _tell_removed(run: JudgedRun, record: int) -> tuple[str, ...]:
    """Removed waste in litres, and its mass; nothing where none is cut."""
    if run.site.diggings is None:
        return ()
    volume = float(run.log.removed[record]) if run.log.removed.size else 0.0
    return (f"{1e3 * volume:.1f} l, {volume * run.site.tank.waste.density:.0f} kg",)


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
