"""What many tests start from: the shipped arm, tank and scene."""

from __future__ import annotations

import gc
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


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Start with the files that run whole scenes, then those with long tests: files are spread over the cores as a whole."""
    weight: dict[Path, int] = {}
    for item in items:
        slow, long = (item.get_closest_marker(name) is not None for name in ("slow", "long"))
        weight[item.path] = max(weight.get(item.path, 0), 2 * slow + long)
    items.sort(key=lambda item: -weight[item.path])  # a stable sort: files and tests stay in order


def pytest_collection_finish() -> None:
    """Look for garbage among what tests make alone, and not too often: all that is loaded by now stays to the end."""
    gc.freeze()
    gc.set_threshold(2_000)  # allocations between two looks, as in Python 3.13; older ones look after 700
