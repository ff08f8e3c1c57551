"""What a figure in a description may be: its unit, the range outside of which it is absurd, and the usual range in it.

An absurd figure is refused with the reason. It would end in an overflow, a division by zero or a run without an end, far from
the file. A figure outside its usual range is read, and warned of: it is more often a slip than meant.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf, pi
from pathlib import Path
from typing import Annotated, Any, get_args

from pydantic import BaseModel, Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from vgtsim.errors import UnusualWarning
from vgtsim.units import to_si

_TEXT = r"^\s*[-+\u2212]?[0-9.]"  # of a quantity, for editors: the loader reads all of it


@dataclass(frozen=True)
class Figure:
    """A quantity, or a bare number in the SI unit `unit`.

    Its size is zero or from `least` to `most`; `usual` is the range that is not warned of. `kind` says what has such a range.
    """

    unit: str
    least: float = 0.0
    most: float = inf
    usual: tuple[float, float] = (-inf, inf)
    kind: str = "such a figure"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Read the quantity, check what the field demands of it, then its size."""
        return core_schema.no_info_wrap_validator_function(self._read, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """A number within the bounds, or a text with a unit."""
        return {"anyOf": [handler(schema["schema"]), {"type": "string", "pattern": _TEXT}]}  # type: ignore[typeddict-item]

    def _read(self, value: Any, check: Callable[[Any], float]) -> float:
        number = check(to_si(value, self.unit))
        if number and not self.least <= abs(number) <= self.most:
            raise ValueError(f"{self.least:g} to {self.most:g} {self.unit}, beyond which {self.kind} makes no sense")
        return number


Length = Annotated[float, Figure("m", most=1e4, kind="a place or distance in a tank")]
SizeOrZero = Annotated[float, Figure("m", 1e-4, 1e3, (5e-4, 60.0), "the size of a part")]
Size = Annotated[SizeOrZero, Field(gt=0)]
Gap = Annotated[float, Field(ge=0), Figure("m", 1e-12, 1e3, (0.0, 60.0), "a distance")]
Tolerance = Annotated[float, Field(gt=0), Figure("m", 1e-12, 1.0, (1e-9, 0.1), "a tolerance of length")]
Mass = Annotated[float, Field(ge=0), Figure("kg", 1e-3, 1e6, (0.0, 5e3), "a load at the tool")]
Time = Annotated[float, Figure("s", 1e-9, 1e5, kind="a time in a run")]
Wait = Annotated[float, Field(gt=0), Figure("s", 1e-3, 1e4, (0.01, 1e3), "a wait in a run")]
Step = Annotated[float, Field(gt=0, le=0.1), Figure("s", 1e-5, 0.1, (1e-4, 0.02), "a time step")]
Frequency = Annotated[float, Figure("1/s", 1e-3, 1e4, kind="a rate of records or a gain")]
Speed = Annotated[float, Field(gt=0), Figure("m/s", 1e-10, 100.0, (1e-9, 5.0), "a speed in a tank")]
Acceleration = Annotated[float, Figure("m/s**2", 1e-5, 1e3, (0.0, 100.0), "an acceleration in a tank")]
Force = Annotated[float, Figure("N", 1e-12, 1e9, (-1e7, 1e7), "a force on an arm")]
Moment = Annotated[float, Figure("N*m", 1e-12, 1e9, (-1e7, 1e7), "a moment on an arm")]
Pressure = Annotated[float, Figure("Pa", 1e-3, 1e9, (-1e8, 1e8), "the pressure of an oil")]
JetPressure = Annotated[float, Field(gt=0), Figure("Pa", 1e3, 1e10, (1e5, 6e8), "the pressure of a jet")]
Power = Annotated[float, Field(gt=0), Figure("W", 1e-3, 1e9, (100.0, 1e6), "the power of a tool")]
Flow = Annotated[float, Field(gt=0), Figure("m**3/s", 1e-9, 10.0, (1e-6, 0.1), "a flow of water or waste")]
Stiffness = Annotated[float, Field(gt=0), Figure("Pa", 1.0, 1e13, (1e9, 1e12), "a modulus")]
Strength = Annotated[float, Field(gt=0), Figure("Pa", 1.0, 1e11, (2e7, 3e9), "a strength")]
Density = Annotated[float, Field(gt=0), Figure("kg/m**3", 1.0, 3e4, (500.0, 2e4), "the density of a solid or a sludge")]
LineMass = Annotated[float, Field(ge=0), Figure("kg/m", 1e-3, 1e4, (0.1, 200.0), "the mass of a line per length")]
BendingStiffness = Annotated[
    float, Field(ge=0), Figure("N*m**2", 1e-6, 1e9, (1.0, 1e6), "a line's stiffness in bending")
]
AngularSpeed = Annotated[float, Field(gt=0), Figure("rad/s", 1e-6, 100.0, (1e-4, 1.0), "the speed of a mast's turn")]
AngularAcceleration = Annotated[
    float, Field(gt=0), Figure("rad/s**2", 1e-6, 1e3, (1e-4, 1.0), "the acceleration of a mast's turn")
]
Angle = Annotated[
    float, Figure("rad", most=4 * pi, usual=(-2 * pi, 2 * pi), kind='an angle (degrees are written "30 deg")')
]
Number = Annotated[float, Figure("dimensionless", most=1e9, kind="a ratio")]


def warn_of_unusual(file: Path, model: BaseModel) -> None:
    """Warn of each figure of a description that lies outside its usual range, by its key."""
    for key, value, figure in _figures(model, ""):
        low, high = figure.usual
        if not low <= value <= high and value:
            usual = f"usual for {figure.kind}: {low:g} to {high:g} {figure.unit}"
            warnings.warn(f"{file}: {key}: found {value:.6g} {figure.unit}; {usual}", UnusualWarning, stacklevel=4)


def _figures(node: Any, key: str) -> Iterator[tuple[str, float, Figure]]:
    """Key, value and kind of each figure that stands alone in its field."""
    if isinstance(node, BaseModel):
        for name, field in type(node).model_fields.items():
            value, place = getattr(node, name), f"{key}.{name}" if key else name
            figure = find_figure(field.annotation, field.metadata)
            if figure is not None and isinstance(value, float):
                yield place, value, figure
            else:
                yield from _figures(value, place)
    elif isinstance(node, dict | tuple):
        for name, entry in node.items() if isinstance(node, dict) else enumerate(node):
            yield from _figures(entry, f"{key}.{name}")


def find_figure(annotation: Any, metadata: list[Any]) -> Figure | None:
    """Figure of a field, or of the one beside None in its union; None where the field holds no single figure."""
    parts = get_args(annotation) if type(None) in get_args(annotation) else ()
    for choice in (metadata, *(getattr(part, "__metadata__", ()) for part in parts)):
        for item in choice:
            if isinstance(item, Figure):
                return item
    return None
