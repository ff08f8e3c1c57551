"""Figures that make no sense are refused with the reason; those that are unusual are warned of."""

from __future__ import annotations

import pytest

from vgtsim.description import load_scene
from vgtsim.description.shipped import list_shipped
from vgtsim.errors import DescriptionError, UnusualWarning

SCENE, TANK, ARM = list_shipped("scene")["arm9_nullspace"], list_shipped("tank")["type_ii"], list_shipped("arm")["arm9"]


def load_with(tmp_path, file, key, value):
    """The scene with the first figure of a key replaced in one of its files; its time step is put in."""
    texts = {kind: source.read_text() for kind, source in (("scene", SCENE), ("tank", TANK), ("arm", ARM))}
    texts["scene"] = texts["scene"].replace("[simulation]", '[simulation]\ntimestep = "5 ms"', 1)
    lines = texts[file].splitlines()
    place = next(i for i, line in enumerate(lines) if line.startswith(f"{key} = "))
    lines[place] = f"{key} = {value}"
    texts[file] = "\n".join(lines)
    texts["scene"] = (
        texts["scene"].replace("../models/arm9/arm9.toml", "arm.toml").replace("tanks/type_ii.toml", "tank.toml")
    )
    for kind, text in texts.items():
        (tmp_path / f"{kind}.toml").write_text(text)
    return load_scene(tmp_path / "scene.toml")


@pytest.mark.parametrize(
    ("file", "key", "value", "words"),
    [
        ("scene", "timestep", '"10 s"', "simulation.timestep: found 10.0; .*allowed: 0.1 or less"),
        (
            "scene",
            "timestep",
            '"1e-6 s"',
            "simulation.timestep: .*1e-05 to 0.1 s, beyond which a time step makes no sense",
        ),
        ("scene", "timestep", "5e-324", "a time step makes no sense"),
        ("scene", "log_rate", '"1e-300 1/s"', "a rate of records"),
        ("scene", "mass", '"1e9 kg"', "payload.mass: .*0.001 to .* kg, beyond which a load at the tool"),
        ("scene", "azimuth", "-170", "motion.start.0.azimuth: .*degrees are written"),
        ("scene", "settle_speed", '"1e-300 m/s"', "a speed in a tank"),
        ("tank", "inner_diameter", '"75e9 ft"', "shell.inner_diameter: .*the size of a part"),
        ("tank", "level", '"1e200 m"', "waste.level"),
        ("arm", "density", '"1e-9 kg/m**3"', "materials.steel.density: .*the density of a solid"),
        ("arm", "radius", "1e-300", "hub.radius: .*the size of a part"),
        ("arm", "radius", '"20 in"', "hub.radius below half the face side"),
        ("arm", "bore", "1e200", "cylinders.*bore: .*the size of a part"),
        ("arm", "bore", '"40 in"', "cylinders.*bore and walls of .* thinner than the barrel is long"),
        ("arm", "pressure", '"1e300 Pa"', "cylinders.*pressure"),
        ("arm", "yield_strength", '"1e-9 Pa"', "a strength makes no sense"),
    ],
)
def test_an_absurd_figure_is_refused_with_the_reason(tmp_path, file, key, value, words):
    with pytest.raises(DescriptionError, match=words):
        load_with(tmp_path, file, key, value)


@pytest.mark.parametrize(
    ("file", "key", "value", "words"),
    [
        ("scene", "mass", '"20000 lb"', "payload.mass: found 9071.85 kg; usual for a load at the tool: 0 to 5000 kg"),
        ("scene", "timestep", '"40 ms"', "simulation.timestep: found 0.04 s; usual for a time step"),
        ("arm", "density", '"25000 kg/m**3"', "materials.steel.density"),
        ("arm", "rate", '"50 m/s"', "cylinders.*rate: found 50 m/s"),
    ],
)
def test_an_unusual_figure_is_read_and_warned_of(tmp_path, file, key, value, words):
    with pytest.warns(UnusualWarning, match=words):
        load_with(tmp_path, file, key, value)
