"""Small studies, and an engine of one thread in place of processes."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from vgtsim.description import load_study
from vgtsim.study import Engine

CHEAP = """
name = "cheap"
scene = "arm9_nullspace"
work = { verb = "workspace", samples = 10, seed = 0 }
"""


@pytest.fixture
def make_study(tmp_path):
    """A study of tiny workspaces with more text, or with other text instead."""

    def make(text, head=CHEAP):
        file = tmp_path / "cheap.toml"
        file.write_text(head + text)
        return load_study(file)

    return make


@pytest.fixture
def one_thread():
    return Engine("here", lambda: ThreadPoolExecutor(1), 2, ())
