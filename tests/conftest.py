"""What many tests start from: the shipped arm, tank and scene."""

from __future__ import annotations

from pathlib import Path

import pytest

import vgtsim.graphics  # noqa: F401  before any test imports MuJoCo
from vgtsim.description import Manipulator, Scene, Tank, load_manipulator, load_scene, load_tank
from vgtsim.kinematics import Chain, hanging_mount

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="session")
def arm15() -> Manipulator:
    return load_manipulator(ROOT / "models/arm15/arm15.toml")


@pytest.fixture(scope="session")
def type_ii() -> Tank:
    return load_tank(ROOT / "scenes/tanks/type_ii.toml")


@pytest.fixture(scope="session")
def reach_scene() -> Scene:
    return load_scene(ROOT / "scenes/type_ii_reach.toml")


@pytest.fixture(scope="session")
def hanging_arm(arm15: Manipulator) -> Chain:
    return Chain(arm15, hanging_mount(7.32))


@pytest.hookimpl(tryfirst=True)  # the plugin that spreads tests over cores reads the groups in the same hook
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep the tests of a file on one core, so that its fixtures are made once, and start the longest groups first.

    A test that is marked `long` itself goes alone, and so does each parameter of a file of whole scenes.
    """
    groups, weight = {}, {}
    for item in items:
        file, slow = item.path.relative_to(ROOT).as_posix(), item.get_closest_marker("slow") is not None
        alone = not slow and any(mark.name == "long" for mark in item.own_markers)  # a whole scene is run once
        call = getattr(item, "callspec", None)
        group = item.nodeid if alone else f"{file}[{call.id}]" if slow and call else file
        item.add_marker(pytest.mark.xdist_group(group))
        groups[item] = group
        weight[group] = max(weight.get(group, 0), 2 * slow + (item.get_closest_marker("long") is not None))
    items.sort(key=lambda item: -weight[groups[item]])  # a stable sort: groups and tests stay in order
