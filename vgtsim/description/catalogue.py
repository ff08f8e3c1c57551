"""Standard tubes and cylinders to choose from, and the writer of an arm's file with the chosen ones."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from importlib import resources
from itertools import takewhile
from pathlib import Path
from typing import Any

from pydantic import Field, model_validator

from vgtsim.description.figures import Pressure, Size
from vgtsim.description.files import load_description
from vgtsim.description.manipulator import Manipulator
from vgtsim.description.schema import Description, Name, Note, closest
from vgtsim.description.sections import Cylinder, Material, Tube
from vgtsim.description.toml_file import read_text
from vgtsim.replacing import replacing

INCH = 0.0254  # m, exactly: the inch of 1959
_PSI = 6894.757293168361  # Pa
_KEPT = ("retracted", "stroke", "rate", "bulk_modulus", "leakage")  # figures of a cylinder that its bore leaves alone
_TUBE = ("outer_diameter", "wall", "pin")
_CYLINDER = ("bore", "rod", "barrel_wall", "head", "eye", "pin")


class TubeSize(Description):
    """A stock size of round tube."""

    outer_diameter: Size
    wall: Size


class CylinderSize(Description):
    """A stock size of cylinder, with the meanings of `Cylinder`. Length and stroke are those of the arm."""

    bore: Size
    rod: Size
    barrel_wall: Size
    head: Size
    eye: Size
    pressure: Pressure = Field(gt=0)
    pin: Size | None = None


class Catalogue(Description):
    """Tubes and cylinders to choose from, in any order, of one material each.

    Attributes:
        cylinder_standard: Source of bores, rods and pressures.
        cylinder_parts: Reason for walls, heads, eyes and pins.
    """

    tube_standard: Note
    cylinder_standard: Note
    cylinder_parts: Note
    material_standard: Note
    materials: dict[Name, Material]
    tube_material: Name
    cylinder_material: Name
    tubes: tuple[TubeSize, ...] = Field(min_length=1)
    cylinders: tuple[CylinderSize, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _materials_are_there(self) -> Catalogue:
        for name in (self.tube_material, self.cylinder_material):
            if name not in self.materials:
                raise ValueError(f"material {name!r}: no such name{closest(name, self.materials)}")
        return self

    def material_of(self, field: str) -> Material:
        """Material of the cylinder or tube that a module's field names."""
        return self.materials[self.cylinder_material if field.endswith("cylinder") else self.tube_material]


def load_catalogue(path: str | Path | None = None) -> Catalogue:
    """Read a catalogue from a TOML file, by default the package's. Errors are those of `load_description`."""
    file = Path(path) if path else Path(str(resources.files("vgtsim.description").joinpath("catalogue.toml")))
    return load_description(file, Catalogue)


def write_sized_arm(source: Path, target: Path, arm: Manipulator, catalogue: Catalogue, reason: str) -> None:
    """Write the file of a sized arm, whole or not at all; `reason` is the note beside each choice.

    Tubes and cylinders change. All other entries and labels of the source stay, and the comments at its top. The target
    may be the source.

    Raises:
        OSError: The file cannot be written.
    """
    text = read_text(source)
    data = tomllib.loads(text)
    olds = list(data["cylinders"].values())
    alike = {key: value for key, value in olds[0].items() if all(other.get(key) == value for other in olds)}
    data["materials"] |= {name: _material(item, catalogue) for name, item in catalogue.materials.items()}
    data["tubes"] = {name: _section(tube, _TUBE, catalogue.tube_standard) for name, tube in arm.tubes.items()}
    data["cylinders"] = {}
    for name, part in arm.cylinders.items():
        given = [key for key in _KEPT if any(key in old for old in olds)]
        kept: dict[str, Any] = {key: _figure(getattr(part, key), reason) for key in given}
        kept |= {key: value for key, value in alike.items() if key not in (*_CYLINDER, "pressure", "material")}
        psi = _figure(f"{part.pressure / _PSI:.6g} psi", catalogue.cylinder_standard)
        sizes = _section(part, _CYLINDER[:2], catalogue.cylinder_standard)
        sizes |= _section(part, _CYLINDER[2:], catalogue.cylinder_parts)
        data["cylinders"][name] = {**sizes, **kept, "pressure": psi}
    for table, module in zip(data["modules"], arm.modules, strict=True):
        for field, name, kind in module.parts():
            if kind != "blocks":
                *outer, key = field.split(".")
                entry = table[outer[0]][int(outer[1])] if outer else table
                entry[key] = _figure(name, reason)
    header = list(takewhile(lambda line: line.startswith("#") or not line.strip(), text.splitlines()))
    if target.parent.resolve() != source.parent.resolve():  # the path of the schema is relative to the source
        header = [line for line in header if not line.startswith("#:schema")]
    with replacing(target) as partial:
        partial.write_text("\n".join([*header, *_toml_lines(data)]) + "\n", encoding="utf-8")


def _material(material: Material, catalogue: Catalogue) -> dict[str, dict[str, Any]]:
    values = {
        "density": f"{material.density:.6g} kg/m**3",
        "youngs_modulus": f"{material.youngs_modulus / 1e9:.6g} GPa",
        "yield_strength": f"{material.yield_strength / 1e6:.6g} MPa",
    }
    return {key: _figure(value, catalogue.material_standard, "sourced") for key, value in values.items()}


def _section(section: Tube | Cylinder, keys: tuple[str, ...], note: str) -> dict[str, Any]:
    """Make the entries of a section: its sizes in inches, as in the standards, and its material."""
    sizes = {key: getattr(section, key) for key in keys if getattr(section, key) is not None}
    entries: dict[str, Any] = {key: _figure(f"{value / INCH:.6g} in", note) for key, value in sizes.items()}
    return entries | {"material": section.material}


def _figure(value: float | str, note: str, label: str = "derived") -> dict[str, Any]:
    return {"value": value, "label": label, "note": note}


def _toml_lines(data: Mapping[str, Any], prefix: str = "") -> list[str]:
    """Lines of a table: plain values must stand before tables and lists of tables."""
    plain = {key: value for key, value in data.items() if not _is_table(value) and not _is_list(value)}
    lines = [f"{key} = {write_value(value)}" for key, value in plain.items()]
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


def write_value(value: Any) -> str:
    """A value as TOML: a figure, a text, a list, or a table in one line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)  # the escapes of TOML are those of JSON
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {write_value(entry)}" for key, entry in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(write_value, value)) + "]"
    return repr(value)
