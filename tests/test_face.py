"""The public names: documented, with shapes wherever arrays are, and imported on first use."""

from __future__ import annotations

import dataclasses
import inspect
import re
from pathlib import Path

import pytest

import vgtsim

ROOT = Path(__file__).parents[1]
NAMES = [name for name in vgtsim.__all__ if name != "__version__"]


def test_the_document_lists_the_public_names_and_no_others():
    text = (ROOT / "docs/python.md").read_text()
    assert sorted(re.findall(r"^\| `vgtsim\.(\w+)", text, re.MULTILINE)) == sorted(vgtsim.__all__)
    assert dir(vgtsim) == vgtsim.__all__


@pytest.mark.parametrize("name", NAMES)
def test_a_public_name_says_the_shapes_of_its_arrays(name):
    thing = getattr(vgtsim, name)
    text = inspect.getdoc(thing)
    assert text
    if dataclasses.is_dataclass(thing):
        given = {field.name: str(field.type) for field in dataclasses.fields(thing)}
    else:
        given = {key: str(value) for key, value in inspect.get_annotations(thing).items()}
    for key, annotation in given.items():
        if "Array" not in annotation:
            continue
        entry = text.split("Returns:")[-1] if key == "return" else text.split(f"{key}:", 1)[-1].split("\n\n")[0]
        assert "shape (" in entry.lower(), f"{name}: {key} is an array of unknown shape"


def test_an_unknown_name_is_refused():
    with pytest.raises(AttributeError, match="no attribute 'simulate'"):
        _ = vgtsim.simulate
