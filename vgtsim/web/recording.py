"""A recorded run as one page: viser's own client with the run in it, which a browser opens from disk.

Viser records what its server is told, with pauses between, and embeds the record in its client. The page adds what no scene
holds: verdict, readings of the instant that is shown, and the scale of the colours.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from viser import ViserServer

from vgtsim.arrays import Array, Index
from vgtsim.log import LogSource, RunLog
from vgtsim.output.colours import scale_end
from vgtsim.output.folders import HTML
from vgtsim.output.html_tables import list_notices, summarise
from vgtsim.output.quantities import MINUS
from vgtsim.output.readings import READINGS, read_instant
from vgtsim.positioning import LeastGap
from vgtsim.replacing import replacing
from vgtsim.site import Site
from vgtsim.verification import JudgedRun, Report
from vgtsim.web.display import Display, Sight, draw_scale

LARGEST = 10_000_000  # bytes of a page: what still goes as an attachment
_MOST = 1500  # frames: going back in time the client reads all of them again, some tenths of a second
_FASTEST = 12.5  # frames a simulated second: half of what is recorded looks smooth
_ROOM = 0.95  # of what is left for frames, as some pack less well than others
_AFTER = 1.0  # s that the last frame stays before the client begins again
_REACH = 3.0  # m within which the nearest thing is looked for
_ASIDE = 0.16  # of the radius of the tank: so much to the right the eye looks, where the table covers the picture
_STILL, _SHADE = 2e-4, 2e-3  # m, and part of the colour scale: a move that no picture shows


@dataclass(frozen=True)
class Recording:
    """What a page holds: frames shown, records of the run, and size of the file in bytes."""

    frames: int
    records: int
    size: int


def write_recording(site: Site, source: LogSource, report: Report, path: Path, largest: int = LARGEST) -> Recording:
    """Write a run as one HTML file with a time slider, whole or not at all; frames are thinned until it is small enough.

    Raises:
        OSError: The file cannot be written.
        ValueError: Not even the first and the last record fit in a page of the largest size, bytes.
    """
    run = JudgedRun(site, source, report)
    played = _Playback(run, HTML if (path.parent / HTML).is_file() else "")
    page, frames = played.write_page(int(min(run.log.count, _MOST, np.ptp(run.log.time[[0, -1]]) * _FASTEST + 2)))
    if len(page) > largest:
        least, few = played.write_page(2)
        part = _ROOM * (largest - len(least)) / (len(page) - len(least))
        page, frames = played.write_page(int(part * frames)) if part * frames > few else (least, few)
    if len(page) > largest:
        raise ValueError(f"a page of {frames} frames takes {len(page)} bytes; allowed: at most {largest}")
    with replacing(path) as partial:
        partial.write_bytes(page)
    return Recording(frames, source.count, len(page))


def choose_records(log: RunLog, axial: Array, count: int) -> Index:
    """At most so many records, evenly over the run, first and last included; those that look like the one before are left out.

    Axial forces have shape (T, M), N.
    """
    end, chosen = scale_end(axial), [0]
    for record in np.unique(np.linspace(0, log.count - 1, count).round().astype(int)).tolist():
        shown = chosen[-1]
        still = np.abs(log.nodes[record] - log.nodes[shown]).max() < _STILL
        alike = np.abs(axial[record] - axial[shown]).max() < _SHADE * end
        told = log.goal[record] == log.goal[shown] and log.settled[record] == log.settled[shown]
        if not (still and alike and told):
            chosen.append(record)
    return np.unique([*chosen, log.count - 1])


@dataclass(frozen=True, eq=False)
class _Playback:
    """A run as a page plays it, with the address of its report, if any."""

    run: JudgedRun
    address: str

    @cached_property
    def end(self) -> float:
        """End of the colour scale, N."""
        return scale_end(self.run.shown.axial)

    def write_page(self, count: int) -> tuple[bytes, int]:
        """The page with at most so many frames, and their number."""
        log, site, report = self.run.log, self.run.site, self.run.report
        chosen = choose_records(log, self.run.shown.axial, count)
        gaps = [self._find_gap(record) for record in chosen.tolist()]
        page = self._record(chosen, gaps)
        times = log.time[chosen] - log.time[0]
        rows = [self._read(record, gap) for record, gap in zip(chosen.tolist(), gaps, strict=True)]
        told = {"starts": times.round(4).tolist(), "times": log.time[chosen].round(4).tolist(), "rows": rows}
        head, body = (
            _load_pages()
            .get_template(name)
            .render(
                title=site.task.title,
                passed=report.passed,
                verdict="PASSED" if report.passed else "FAILED",
                summary=summarise(report),
                notices=list_notices(log, report),
                names=["time", *READINGS, "nearest"],
                scale=draw_scale(self.end),
                frames=len(chosen),
                records=self.run.source.count,
                report=HTML,
                address=self.address,
                readings=json.dumps(told, separators=(",", ":")).replace("<", "\\u003c"),
            )
            for name in ("head.html", "body.html")
        )
        page = re.sub(r"<title>.*?</title>", "", page, count=1, flags=re.DOTALL)
        at, close = page.index("</head>"), page.rindex("</body>")
        return (page[:at] + head + page[at:close] + body + page[close:]).encode(), len(chosen)

    def _record(self, chosen: Index, gaps: list[LeastGap | None]) -> str:
        """Viser's client with the frames of some records in it."""
        log = self.run.log
        with _open_server() as server:
            display = Display(server, self.run.site, self.end)
            _aim(server, self.run.site, above=bool(log.height.any()))
            record = server.get_scene_serializer()
            pauses = np.append(np.diff(log.time[chosen]), _AFTER)
            for k, gap, pause in zip(chosen.tolist(), gaps, pauses.tolist(), strict=True):
                sight = Sight(
                    nodes=log.nodes[k],
                    axial=self.run.shown.axial[k],
                    height=float(log.height[k]),
                    heights=log.bed[k] if log.bed.size else None,
                    target=self._find_target(k),
                    gap=gap,
                )
                display.show(sight)
                record.insert_sleep(pause)
            return record.as_html()

    def _find_gap(self, record: int) -> LeastGap | None:
        """The nearest thing, the arm itself and the mast included; none while the mast is not at its working depth."""
        log = self.run.log
        if log.height[record]:
            return None
        points = np.concatenate([log.nodes[record], log.tool_position[record, None]])
        return self.run.site.surroundings.unloaded.find_nearest(points, _REACH)

    def _tell_nearest(self, record: int, gap: LeastGap | None) -> str:
        """Distance and names of the nearest things; while the mast is moved, as checks measure it in the riser's bore."""
        if gap:
            return f"{gap.gap:.3f} m, {gap.bodies}".replace("-", MINUS)
        log, proximity = self.run.log, self.run.shown.proximity
        if not log.height[record]:
            return f"more than {_REACH:g} m"
        found = proximity.apart(log.nodes[record, None], log.tool_position[record, None])
        place = int(found.nearest[0])
        part = proximity.name_around(int(found.body[0, place]))
        return f"{found.distance[0, place]:.3f} m, {part} to {found.places[place]}".replace("-", MINUS)

    def _find_target(self, record: int) -> Array | None:
        """Where the tool should be: an operator's target, or the end of the stage of the run."""
        log = self.run.log
        if log.target.size:
            return log.target[record]
        stage = int(log.goal[record])
        pose = self.run.site.stage_poses[stage] if stage >= 0 else None
        return pose if pose is not None and np.isfinite(pose).all() else None

    def _read(self, record: int, gap: LeastGap | None) -> list[str]:
        told = read_instant(self.run, record, self.run.shown.axial[record])
        return [*told, self._tell_nearest(record, gap)]


def _aim(server: ViserServer, site: Site, *, above: bool) -> None:
    """Look past the table at the right; from farther where the arm comes from above the ground."""
    camera, radius, crown = server.initial_camera, site.tank.shell.inner_diameter / 2, site.tank.shell.crown
    if above:
        camera.position, camera.look_at = (0.7 * radius, -4.8 * radius, 2.2 * crown), (0.0, 0.0, 1.55 * crown)
    aside = (1.9 if above else 1.0) * _ASIDE * radius
    camera.position, camera.look_at = camera.position + [aside, 0, 0], camera.look_at + [aside, 0, 0]


@contextmanager
def _open_server() -> Iterator[ViserServer]:
    """A server of viser that says nothing on the terminal, on a free port; it stops at the end."""
    with redirect_stdout(io.StringIO()):
        server = ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        yield server
    finally:
        with redirect_stdout(io.StringIO()):
            server.stop()


@lru_cache(maxsize=1)
def _load_pages() -> Environment:
    return Environment(loader=PackageLoader("vgtsim.web", "pages"), autoescape=True, undefined=StrictUndefined)
