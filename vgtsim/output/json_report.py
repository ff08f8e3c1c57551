"""The report for machines."""

from __future__ import annotations

import json
from pathlib import Path

from vgtsim.replacing import replacing
from vgtsim.verification import Report


def write_report_json(report: Report, path: str | Path) -> None:
    """Write `report.json`: verdict, checks, performance and versions.

    Args:
        report: The report; figures that are not finite become null.
        path: File to write, whole or not at all.

    Raises:
        OSError: The folder cannot be written.
    """
    text = json.dumps(report.to_dict(), indent=2, ensure_ascii=False, allow_nan=False)
    with replacing(path) as partial:
        partial.write_text(text + "\n", encoding="utf-8")
