"""Standard tubes and cylinders to choose from, and an arm's file written anew with the chosen ones."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError

from vgtsim.description.schema import Description
from vgtsim.description.sections import Cylinder, Tube
from vgtsim.errors import DescriptionError
from vgtsim.replacing import replacing
from vgtsim.units import Length, Pressure

INCH = 0.0254
_KEPT = ("retracted", "stroke", "rate")  # of a cylinder: the arm's, whatever its bore


class TubeSize(Description):
    """A stock size of round tube.

    Attributes:
        outer_diameter: m.
        wall: m.
    """

    outer_diameter: Length = Field(gt=0)
    wall: Length = Field(gt=0)


class CylinderSize(Description):
    """A stock size of cylinder; length and stroke are the arm's.

    Attributes:
        bore: m.
        rod: m.
        barrel_wall: m.
        head: Total thickness of steel in heads and piston, m.
        eye: Distance from a pin to barrel or full rod, m.
        pressure: Rated, Pa.
    """

    bore: Length = Field(gt=0)
    rod: Length = Field(gt=0)
    barrel_wall: Length = Field(gt=0)
    head: Length = Field(gt=0)
    eye: Length = Field(gt=0)
    pressure: Pressure = Field(gt=0)


class Catalogue(Description):
    """What sections and bores may be chosen from.

    Attributes:
        tube_standard: Where the tube sizes come from.
        cylinder_standard: Where the cylinder sizes come from.
        tubes: In any order.
        cylinders: In any order.
    """

    tube_standard: str
    cylinder_standard: str
    tubes: tuple[TubeSize, ...] = Field(min_length=1)
    cylinders: tuple[CylinderSize, ...] = Field(min_length=1)


def load_catalogue(path: str | Path | None = None) -> Catalogue:
    """Read a catalogue.

    Args:
        path: TOML file; absent for the one that comes with the package.

    Returns:
        The catalogue.

    Raises:
        DescriptionError: The file is missing, is not TOML, or holds no catalogue.
    """
    file = Path(path) if path else Path(str(resources.files("vgtsim.description").joinpath("catalogue.toml")))
    try:
        return Catalogue.model_validate(tomllib.loads(file.read_text(encoding="utf-8")))
    except OSError as error:
        raise DescriptionError(file, "", error.strerror or str(error), "a readable TOML file") from None
    except tomllib.TOMLDecodeError as error:
        raise DescriptionError(file, "", f"a TOML syntax error, {error}", "TOML 1.0") from None
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(map(str, first["loc"]))
        raise DescriptionError(file, key, repr(first["input"])[:60], first["msg"]) from None


def write_sized_arm(
    source: Path,
    target: Path,
    tubes: Mapping[str, Tube],
    cylinders: Mapping[str, Cylinder],
    chosen: Mapping[tuple[str, str], str],
    notes: tuple[str, str, str],
) -> None:
    """Write an arm's file again with other tubes and cylinders; everything else, labels included, is kept.

    Args:
        source: The arm's file.
        target: File to write, whole or not at all.
        tubes: The tubes used, by name.
        cylinders: The cylinders used, by name.
        chosen: Section of each module and field, for example `("m1", "longeron_tube")`.
        notes: What stands behind a tube's size, a cylinder's size and a choice.

    Raises:
        OSError: The file cannot be written.
    """
    data = tomllib.loads(source.read_text(encoding="utf-8"))
    olds = list(data["cylinders"].values())
    replaced = ("bore", "rod", "barrel_wall", "head", "eye", "pressure", "material")
    alike = {key: value for key, value in olds[0].items() if all(other.get(key) == value for other in olds)}
    data["tubes"] = {
        name: {
            "outer_diameter": _sized(tube.outer_diameter, notes[0]),
            "wall": _sized(tube.wall, notes[0]),
            "material": tube.material,
        }
        for name, tube in tubes.items()
    }
    data["cylinders"] = {}
    for name, part in cylinders.items():
        sizes = {key: _sized(getattr(part, key), notes[1]) for key in ("bore", "rod", "barrel_wall", "head", "eye")}
        kept = {key: {"value": getattr(part, key), "label": "derived", "note": notes[1]} for key in _KEPT}
        kept |= {key: value for key, value in alike.items() if key not in replaced}
        pressure = {"value": part.pressure, "label": "derived", "note": notes[1]}
        data["cylinders"][name] = {**sizes, **kept, "pressure": pressure, "material": part.material}
    for module in data["modules"]:
        for (name, field), section in chosen.items():
            if name == module["name"]:
                module[field] = {"value": section, "label": "derived", "note": notes[2]}
    with replacing(target) as partial:
        partial.write_text("\n".join(_toml_lines(data)) + "\n", encoding="utf-8")


def _sized(value: float, note: str) -> dict[str, str]:
    return {"value": f"{value / INCH:.6g} in", "label": "derived", "note": note}


def _toml_lines(data: Mapping[str, Any], prefix: str = "") -> list[str]:
    """Plain values first, then tables, then lists of tables."""
    plain = {key: value for key, value in data.items() if not _is_table(value) and not _is_list(value)}
    lines = [f"{key} = {_toml_value(value)}" for key, value in plain.items()]
    for key, value in data.items():
        if _is_table(value):
            inner = _toml_lines(value, f"{prefix}{key}.")
            only_tables = all(_is_table(entry) for entry in value.values())
            lines += inner if only_tables else ["", f"[{prefix}{key}]", *inner]
        elif _is_list(value):
            for entry in value:
                lines += ["", f"[[{prefix}{key}]]", *_toml_lines(entry, f"{prefix}{key}.")]
    return lines


def _is_table(value: Any) -> bool:
    return isinstance(value, dict) and "value" not in value


def _is_list(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], dict) and "value" not in value[0]


def _toml_value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml_value(entry)}" for key, entry in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml_value, value)) + "]"
    return repr(value)
