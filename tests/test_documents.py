"""Documents name only files and folders that are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "models").glob("*/README.md"))]
NAMED = re.compile(r"`((?:[a-z0-9_]+/)+(?:[A-Za-z0-9_.]+)?|[a-z0-9_]+\.py)`")
ROOMS = [ROOT / "vgtsim", ROOT]


def exists(name):
    """A path from the checkout, from the package or, for a file alone, anywhere in either."""
    if name.startswith("out/"):  # left by a run
        return True
    if any((room / name).exists() for room in ROOMS):
        return True
    return "/" not in name and any((ROOT / top).rglob(name) for top in ("vgtsim", "tests", "studies", "examples"))


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_files_that_a_document_names_are_there(document):
    named = NAMED.findall(document.read_text(encoding="utf-8"))
    assert [name for name in named if not exists(name)] == []
