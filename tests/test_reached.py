"""What the package holds is reached by a run, a verb, an example, a script or a page: nothing is there for tests alone."""

from __future__ import annotations

import ast
import re
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
USERS = [*ROOT.glob("examples/*.py"), *(path for path in ROOT.glob("scripts/*") if path.is_file())]
BY_OTHERS = {"checkMotion"}  # OMPL calls it
PAGES = [path for path in (*ROOT.glob("docs/*.md"), *ROOT.glob("docs/*/*.md")) if path.stem != "dissertation"]


@pytest.fixture(scope="module")
def trees():
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in sorted((ROOT / "vgtsim").rglob("*.py"))}


@pytest.fixture(scope="module")
def used(trees):
    """How often each name is used in the package: to import or to list it is no use."""
    count: Counter[str] = Counter()
    for node in (node for tree in trees.values() for node in ast.walk(tree)):
        count[getattr(node, "id", "") or getattr(node, "attr", "")] += isinstance(node, ast.Name | ast.Attribute)
    return count


@pytest.fixture(scope="module")
def told():
    """Words of the programs and pages that users read."""
    return {word for path in (*USERS, *PAGES) for word in re.findall(r"\w+", path.read_text(encoding="utf-8"))}


def is_registered(node):
    """Whether a decorator hands the function on: as a verb, a validator, a check, or to a page's control."""
    said = [ast.unparse(item) for item in node.decorator_list]
    return any(word in text for text in said for word in ("app.", "_validator", "report", ".on_"))


def test_nothing_is_reached_from_tests_alone(trees, used, told):
    lone = [
        f"{path.relative_to(ROOT)}:{node.lineno} {node.name}"
        for path, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("__")
        if not used[node.name] and node.name not in told | BY_OTHERS and not is_registered(node)
    ]
    assert not lone, "\n".join(lone)
