"""The table of benchmarks: each figure is the printed one, and the document shows the figures of today."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from studies.gallery import make_rows, make_table

DOCUMENT = Path(__file__).parents[2] / "docs" / "benchmarks.md"

pytestmark = pytest.mark.long


@cache
def rows():
    return make_rows()


def test_every_figure_is_the_printed_one():
    wrong = [f"{row.problem}, {row.quantity}: {row.computed} for {row.printed}" for row in rows()]
    wrong = [text for text, row in zip(wrong, rows(), strict=True) if not abs(row.computed - row.printed) <= row.off]
    assert wrong == []


def test_document_shows_the_figures_of_today(monkeypatch):
    """`scripts/bench_multibody table` prints the table that belongs there."""
    monkeypatch.setattr("studies.gallery.make_rows", rows)
    assert make_table() in DOCUMENT.read_text(encoding="utf-8")
