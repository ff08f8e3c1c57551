"""A run with its verdict: what report, film and page are made of."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from vgtsim.log import Hold, LogSource, RunLog, thin
from vgtsim.site import Site
from vgtsim.verification.evidence import Evidence
from vgtsim.verification.report import Report


@dataclass(frozen=True, eq=False)
class JudgedRun:
    """A run of a site, or of one phase of its mission, that was judged; its whole log is the `source`.

    What is shown of it is made on first use, of so many records as plots can show.
    """

    site: Site
    source: LogSource
    report: Report

    @property
    def duration(self) -> float:
        """Simulated time, s."""
        return self.source.performance["simulated_s"]

    @cached_property
    def shown(self) -> Evidence:
        """What the records say that are shown; differences of them are no speeds where the log is long."""
        return Evidence(self.site, thin(self.source))

    @property
    def log(self) -> RunLog:
        """The records that are shown, all of a short log."""
        return self.shown.log

    @cached_property
    def holds(self) -> tuple[Hold, ...]:
        """Settled stays at goals, by the records that are shown."""
        return self.shown.outline.holds
