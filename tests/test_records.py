"""Records with many fields are built by keyword, no two public classes share a name, no constant stands twice."""

from __future__ import annotations

import ast
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1] / "vgtsim"
# of named tuples, of the operating system, and of Numba and viser, which have no public ones
OF_OTHERS = {"_asdict", "_replace", "_fields", "_exit", "_source_stamp", "_http_server_root", "_impl"}
MOST = 5  # fields that a reader can still tell by their order


@pytest.fixture(scope="module")
def trees():
    """Syntax trees by file: made by the tests that read them, for a module is imported by every process of the tests."""
    return {
        path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8")) for path in ROOT.rglob("*.py")
    }


@pytest.fixture(scope="module")
def classes(trees):
    return [node for tree in trees.values() for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]


def is_record(node):
    return any(
        word in ast.unparse(item)
        for item in (*node.decorator_list, *node.bases)
        for word in ("dataclass", "NamedTuple")
    )


def test_records_with_many_fields_are_built_by_keyword(trees, classes):
    fields = {c.name: sum(isinstance(item, ast.AnnAssign) for item in c.body) for c in classes if is_record(c)}
    assert max(fields.values()) > MOST
    wrong = [
        f"{file}:{call.lineno} {call.func.id}"
        for file, tree in trees.items()
        for call in ast.walk(tree)
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and fields.get(call.func.id, 0) > MOST
        if any(not isinstance(item, ast.Starred) for item in call.args)
    ]
    assert wrong == []


def test_names_of_classes_have_one_meaning(classes):
    count = Counter(node.name for node in classes if not node.name.startswith("_"))
    assert [name for name, times in count.items() if times > 1] == []


def test_names_of_functions_have_one_meaning_in_a_room(trees):
    """Rows of the report may have the names of alike rows of other things; kinds of modules answer the same questions."""
    count = Counter(
        (file.split("/")[0], node.name)
        for file, tree in trees.items()
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and not node.name.startswith(("_", "check_")) and "/modules/" not in file
    )
    assert [name for name, times in count.items() if times > 1] == []


def test_no_file_is_long():
    """A reader takes in a file of 150 lines, and finds the way in one of 400."""
    lines = {str(path): len(path.read_text(encoding="utf-8").splitlines()) for path in ROOT.rglob("*.py")}
    assert [name for name, count in lines.items() if count > 400] == []


SHARED = {
    "run": "a command of the command line calls the function of its name",
    "verify": "a command of the command line calls the function of its name",
    "jacobian": "the same derivative of a cell of the general kind and, for users, of a posture",
    "angle_jacobian": "the same derivative of one cell and of two",
}


def test_names_of_functions_have_one_meaning_in_the_package(trees):
    """Of two rooms alike: but for rows of the report, for what all kinds of modules give, and for those with a reason."""
    places = {}
    for file, tree in trees.items():
        room = "kinds" if "/modules/" in file else file.split("/")[0]
        for node in tree.body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith(("_", "check_")):
                places.setdefault(node.name, set()).add(room)
    assert {name for name, rooms in places.items() if len(rooms) > 1} == SHARED.keys()


def find_private(tree):
    """Private attributes of other files' objects that a file reads, and private names that it imports."""
    nodes = list(ast.walk(tree))
    own = {node.name for node in nodes if isinstance(node, ast.FunctionDef)}
    own |= {node.target.id for node in nodes if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name)}
    read = [node for node in nodes if isinstance(node, ast.Attribute)]
    own |= {node.attr for node in read if isinstance(node.value, ast.Name) and node.value.id in ("self", "cls")}
    names = {node.attr for node in read}
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("vgtsim"):
            names |= {alias.name for alias in node.names}
    return {name for name in names - own if name.startswith("_") and not name.startswith("__")} - OF_OTHERS


def test_no_file_reaches_for_what_another_keeps_to_itself(trees):
    assert {file: found for file, tree in trees.items() if (found := find_private(tree))} == {}


def test_a_run_is_stepped_and_its_log_made_in_one_place(trees):
    """Model files settle for a picture or a keyframe; logs on disk are read by their book."""
    calls = {
        (file, ast.unparse(node.func).split(".")[-1])
        for file, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
    }
    assert {file for file, name in calls if name == "RunLog"} == {"plant/recorder.py", "log/book.py"}
    stepping = {file for file, name in calls if name in ("mj_step", "mj_step1", "mj_step2")}
    assert stepping == {"plant/correction.py", "mjcf/files.py", "mjcf/keyframes.py"}


def test_each_constant_of_physics_stands_once(trees):
    """Gravity, Omega, steel, 1000 lb, the column curve of AISC 360, and the ramps of a path."""
    once = (9.80665, 1.67, 7850.0, 453.59237, 4.71, 0.658, 0.877, 1.875)
    count = Counter(
        node.value
        for tree in trees.values()
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, float)
    )
    assert [(value, count[value]) for value in once if count[value] != 1] == []


def is_table(node, constants):
    """Whether a tuple is read as a whole: a constant of a module, literals alone, or the type of a row of numbers."""
    plain = all(isinstance(item, ast.Constant | ast.Tuple) or ast.unparse(item) == "float" for item in node.elts)
    return plain or node in constants


def find_long_tuples(tree):
    """Lines that make, unpack or name the type of a tuple of many; `A, B, ... = range(n)` numbers constants of a module."""
    top = [node for node in tree.body if isinstance(node, ast.Assign | ast.AnnAssign) and node.value]
    constants = {item for node in top if "tuple[" not in ast.unparse(node) for item in ast.walk(node)}
    long = [node for node in ast.walk(tree) if isinstance(node, ast.Tuple) and len(node.elts) > MOST]
    return sorted({node.lineno for node in long if not is_table(node, constants)})


def test_no_plain_tuple_is_long(trees):
    assert {file: lines for file, tree in trees.items() if (lines := find_long_tuples(tree))} == {}
