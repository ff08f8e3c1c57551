"""Quantities with units, as users write them, to SI floats.

A quantity is one number and one unit. The number has a sign (ASCII or U+2212), a decimal point, and an exponent or a fraction:
"-1.5e-3 m", "3 1/2 in". Feet with inches ("3 ft 6 in", 3' 6") and degrees with minutes and seconds (12° 30' 15") are one
number too. Everything else is refused. A unit is a product of names that pint knows, each with a power: "N*m", "kg/m**3".
"""

from __future__ import annotations

import math
import re
from functools import lru_cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pint

_LONGEST = 100  # characters of a quantity; the longest sensible one has some thirty
_SHOWN = 40  # characters of a wrong text that a message repeats
_SIGN = r"(?P<sign>[-+\u2212])?"
_DECIMAL = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)"
_FRACTION = r"(?P<over>[0-9]{1,9})/(?P<under>[0-9]{1,9})"
_INCHES = rf"(?P<inches>{_DECIMAL})(?:\s+{_FRACTION})?"
_FEET = re.compile(rf"{_SIGN}(?:(?P<feet>[0-9]+)\s*(?:ft|['\u2032])\s*)?{_INCHES}\s*(?:in|[\"\u2033])")
_FEET_ALONE = re.compile(rf"{_SIGN}(?P<feet>{_DECIMAL})\s*['\u2032]")
_ANGLE = re.compile(
    rf"{_SIGN}(?P<degrees>[0-9]+)\s*°\s*(?P<minutes>{_DECIMAL})\s*['\u2032](?:\s*(?P<seconds>{_DECIMAL})\s*[\"\u2033])?"
)
_MIXED = re.compile(rf"{_SIGN}(?:(?P<whole>[0-9]+)\s+)?{_FRACTION}(?![0-9./])")
_PLAIN = re.compile(rf"{_SIGN}(?P<number>{_DECIMAL}(?:[eE][-+\u2212]?[0-9]+)?)")
_NAME = r"(?:[A-Za-zµμΩ_]{1,32}(?:_[0-9]{1,2})?|°|%)"
_FACTOR = re.compile(rf"(?P<name>{_NAME}|1(?=/))(?:(?:\*\*|\^)(?P<power>-?[1-9])|(?P<raised>[²³⁴]))?")
_BETWEEN = re.compile(r"\s*(?P<operator>\*(?!\*)|/|·|⋅|\s)\s*")
_RAISED = {"²": 2, "³": 3, "⁴": 4}
_FORCE = ("kilogram * meter * second**-2", "[length] * [mass] * [time]**-2")
_PRESSURE = ("kilogram * meter**-1 * second**-2", "[length]**-1 * [mass] * [time]**-2")
_FLOW = ("meter**3 * second**-1", "[length]**3 * [time]**-1")
_FREQUENCY = ("second**-1", "[time]**-1")

# Number of SI base units in a usual unit, those units, and the dimension, as pint measures them: pint takes half a second to
# load, and only other units need it.
USUAL_UNITS: dict[str, tuple[float, str, str]] = {
    "": (1.0, "dimensionless", "dimensionless"),
    "dimensionless": (1.0, "dimensionless", "dimensionless"),
    "m": (1.0, "meter", "[length]"),
    "mm": (0.001, "meter", "[length]"),
    "in": (0.0254, "meter", "[length]"),
    "ft": (0.30479999999999996, "meter", "[length]"),
    "rad": (1.0, "radian", "dimensionless"),
    "deg": (0.017453292519943295, "radian", "dimensionless"),
    "s": (1.0, "second", "[time]"),
    "ms": (0.001, "second", "[time]"),
    "1/s": (1.0, *_FREQUENCY),
    "Hz": (1.0, *_FREQUENCY),
    "m/s": (1.0, "meter * second**-1", "[length] * [time]**-1"),
    "m/s**2": (1.0, "meter * second**-2", "[length] * [time]**-2"),
    "rad/s": (1.0, "radian * second**-1", "[time]**-1"),
    "rad/s**2": (1.0, "radian * second**-2", "[time]**-2"),
    "kg": (1.0, "kilogram", "[mass]"),
    "lb": (0.4535923700000001, "kilogram", "[mass]"),
    "kg/m": (1.0, "kilogram * meter**-1", "[length]**-1 * [mass]"),
    "kg/m**3": (1.0, "kilogram * meter**-3", "[length]**-3 * [mass]"),
    "N": (1.0, *_FORCE),
    "kN": (1000.0, *_FORCE),
    "N*m": (1.0, "kilogram * meter**2 * second**-2", "[length]**2 * [mass] * [time]**-2"),
    "N*m**2": (1.0, "kilogram * meter**3 * second**-2", "[length]**3 * [mass] * [time]**-2"),
    "Pa": (1.0, *_PRESSURE),
    "MPa": (1e6, *_PRESSURE),
    "GPa": (1e9, *_PRESSURE),
    "psi": (6894.7572931683635, *_PRESSURE),
    "W": (1.0, "kilogram * meter**2 * second**-3", "[length]**2 * [mass] * [time]**-3"),
    "m**3/s": (1.0, *_FLOW),
    "l/min": (1.666666666666667e-05, *_FLOW),
    "gal/min": (6.309019639999999e-05, *_FLOW),
}


def to_si(value: float | str, unit: str, *, bare: bool = False) -> float:
    """Convert a quantity such as "42 in" to a number in an SI unit; a bare number is already in that unit.

    A text without a unit is a bare number if `bare`, as on a command line, where all is text.

    Raises:
        ValueError: The text is not one number and one unit, has another dimension, or is not finite.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f"a number or a quantity such as '1 {unit}'")
    if isinstance(value, str):
        number, written = _read_quantity(value, unit)
        written = written or unit if bare else written
        wanted, given = _measure(unit), _measure(written)
        if given[2] != wanted[2]:
            raise ValueError(f"has dimension {given[2]}; expected that of {unit}")
        if given[1] != wanted[1]:  # an angle in place of a number, or a number in place of an angle
            raise ValueError(f"is in {given[1]}; expected {wanted[1]}")
        return _finite(number * _factor(written, unit))
    return _finite(value)


def to_base(value: float | str) -> tuple[float, str]:
    """Convert a quantity of any dimension to a number in SI base units, and its dimension; a bare number has none, "".

    Raises:
        ValueError: The text is not a quantity.
    """
    if isinstance(value, int | float):
        return _finite(value), ""
    number, written = _read_quantity(value, "m")
    factor, _, dimension = _measure(written)
    return _finite(number * factor), dimension


def _finite(value: float) -> float:
    try:
        number = float(value)
    except OverflowError:  # an integer of hundreds of digits
        number = math.inf
    if not math.isfinite(number):
        raise ValueError("must be finite")
    return number


def _read_quantity(text: str, unit: str) -> tuple[float, str]:
    """Number and unit of a text; `unit` is one for the message."""
    like = "one number, like '0.5'" if unit == "dimensionless" else f"one number and one unit, like '1 {unit}'"
    try:
        if len(text) > _LONGEST:
            raise ValueError(f"{len(text)} characters, {_shorten(text)}")
        number, written, digits = _read_number(text.strip())
        if written not in USUAL_UNITS:
            _unit(written)
    except ValueError as error:
        raise ValueError(f"not a quantity: {error}; expected {like}") from None
    if number == 0 and re.search("[1-9]", re.split("[eE]", digits)[0]):
        raise ValueError(f"{_shorten(text)} is too small for a number")
    return number, written


def _read_number(text: str) -> tuple[float, str, str]:
    """Number of a text, the unit that is left over, and the number as it was written."""
    if found := _ANGLE.fullmatch(text):
        return _signed(found, _sexagesimal(found)), "deg", text
    if (found := _FEET.fullmatch(text)) and (found["feet"] or text[-1] in '"\u2033'):
        return _signed(found, _inches(found)), "in", text
    if found := _FEET_ALONE.fullmatch(text):
        return _signed(found, float(found["feet"])), "ft", text
    if found := _MIXED.match(text):
        return _signed(found, _fraction(found) + int(found["whole"] or 0)), text[found.end() :].strip(), found[0]
    if found := _PLAIN.match(text):
        number = float(found["number"].replace("\u2212", "-"))
        return _signed(found, number), text[found.end() :].strip(), found[0]
    must = "must be finite" if text.lstrip("-+\u2212")[:3].lower() in ("inf", "nan") else "must start with a number"
    raise ValueError(f"{_shorten(text)} {must}")


def _signed(found: re.Match[str], amount: float) -> float:
    return -amount if found["sign"] in ("-", "\u2212") else amount


def _fraction(found: re.Match[str]) -> float:
    over, under = int(found["over"]), int(found["under"])
    if not under or (over >= under and found.groupdict().get("whole", found.groupdict().get("inches"))):
        raise ValueError(f"{_shorten(found[0])} has no proper fraction")
    return over / under


def _inches(found: re.Match[str]) -> float:
    inches = float(found["inches"]) + (_fraction(found) if found["over"] else 0.0)
    if found["over"] and "." in found["inches"]:
        raise ValueError(f"{_shorten(found[0])} has a decimal point and a fraction")
    if found["feet"] and inches >= 12:
        raise ValueError(f"{_shorten(found[0])} has {inches:g} inches beside its feet, where 12 make one more foot")
    return 12 * float(found["feet"] or 0) + inches


def _sexagesimal(found: re.Match[str]) -> float:
    minutes, seconds = float(found["minutes"]), float(found["seconds"] or 0)
    if max(minutes, seconds) >= 60 or (found["seconds"] and "." in found["minutes"]):
        raise ValueError(f"{_shorten(found[0])} needs minutes and seconds below 60, decimals in the last one only")
    return int(found["degrees"]) + minutes / 60 + seconds / 3600


def _read_unit(text: str) -> list[tuple[str, int]]:
    """Names and powers of a unit."""
    factors, place, sign = [], 0, 1
    while place < len(text):
        found = _FACTOR.match(text, place)
        if not found:
            raise ValueError(_left_over(text))
        power = int(found["power"] or _RAISED.get(found["raised"], 1))
        factors += [] if found["name"] == "1" else [(found["name"], sign * power)]
        place = found.end()
        between = _BETWEEN.match(text, place)
        if place < len(text) and (not between or between.end() == len(text)):
            raise ValueError(_left_over(text))
        if between:
            place, sign = between.end(), -1 if between["operator"] == "/" else 1
    return factors


def _left_over(text: str) -> str:
    hint = ""
    if text.startswith(","):
        hint = " (write a decimal point, and no comma between groups of digits)"
    elif re.match(r"[-+\u2212]?[0-9.]", text):
        hint = " (one number only)"
    return f"after the number stands {_shorten(text)}, which is no unit{hint}"


def _shorten(text: str) -> str:
    return repr(text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "...")


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry:
    """Build the unit registry once. Import pint here: it is slow, and only parsing needs it."""
    import pint

    return pint.UnitRegistry()


@lru_cache(maxsize=256)
def _unit(text: str) -> pint.Unit:
    """Look up a unit, name by name: pint would evaluate a whole text as an expression."""
    import pint

    registry = _registry()
    unit = registry.Unit("")
    for name, power in _read_unit(text):
        try:
            unit *= registry.Unit(name) ** power
            scaled = registry.Quantity(0.0, unit).to_root_units().magnitude == 0
        except (pint.PintError, ValueError, AttributeError, TypeError, AssertionError):
            raise ValueError(f"no unit {name!r} is known") from None
        if not scaled:
            raise ValueError(f"the unit {name!r} does not start at zero")
    return unit


@lru_cache(maxsize=256)
def _measure(text: str) -> tuple[float, str, str]:
    """SI base units in a unit, its units, and its dimension; an angle has its own units, and the dimension of a number."""
    return USUAL_UNITS.get(text) or _measure_by_pint(text)


def _measure_by_pint(text: str) -> tuple[float, str, str]:
    quantity = _registry().Quantity(1.0, _unit(text))
    based = quantity.to_base_units()
    return float(based.magnitude), _write(dict(based.unit_items())), _write(dict(quantity.dimensionality))


def _write(powers: Mapping[str, Any]) -> str:
    """Write a product in one order, whatever the order in which it was made."""
    factors = [name if power == 1 else f"{name}**{power:g}" for name, power in sorted(powers.items())]
    return " * ".join(factors) or "dimensionless"


@lru_cache(maxsize=256)
def _factor(text: str, unit: str) -> float:
    """Number of one unit in another."""
    if text in USUAL_UNITS and unit in USUAL_UNITS and USUAL_UNITS[unit][0] == 1.0:
        return USUAL_UNITS[text][0]
    return _factor_by_pint(text, unit)


def _factor_by_pint(text: str, unit: str) -> float:
    return float(_registry().Quantity(1.0, _unit(text)).to(_unit(unit)).magnitude)
