"""Quantities with units, as users write them, to SI floats."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator

if TYPE_CHECKING:
    from collections.abc import Callable

    import pint

# pint evaluates the text as an expression, so odd texts raise errors of Python
_UNREADABLE = (ArithmeticError, AttributeError, AssertionError, TypeError, ValueError, SyntaxError)


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry:
    """Build the unit registry once. Import pint here: it is slow, and only parsing needs it."""
    import pint

    return pint.UnitRegistry()


def to_si(value: float | str, unit: str) -> float:
    """Convert a quantity such as "42 in" to a number in an SI unit; a bare number is already in that unit.

    Raises:
        ValueError: The text is not a quantity, has another dimension, or is not finite.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f"expected a number or a quantity such as '1 {unit}'")
    if isinstance(value, str):
        quantity = _read_quantity(value, unit)
        if not quantity.check(unit):
            raise ValueError(f"has dimension {quantity.dimensionality}; expected that of {unit}")
        value = quantity.to(unit).magnitude
    number = float(value)
    if not math.isfinite(number):
        raise ValueError("must be finite")
    return number


def to_base(value: float | str) -> tuple[float, str]:
    """Convert a quantity of any dimension to a number in SI base units, and its dimension; a bare number has none, "".

    Raises:
        ValueError: The text is not a quantity.
    """
    if isinstance(value, int | float):
        return float(value), ""
    quantity = _read_quantity(value, "m").to_base_units()
    return float(quantity.magnitude), str(quantity.dimensionality)


def _read_quantity(text: str, unit: str) -> Any:
    import pint

    try:
        return _registry().Quantity(text)
    except _UNREADABLE + (pint.PintError,) as error:
        raise ValueError(f"not a quantity; expected something like '1 {unit}'") from error


def _parser(unit: str) -> Callable[[Any], float]:
    return lambda value: to_si(value, unit)


Length = Annotated[float, BeforeValidator(_parser("m"))]
Mass = Annotated[float, BeforeValidator(_parser("kg"))]
Time = Annotated[float, BeforeValidator(_parser("s"))]
Frequency = Annotated[float, BeforeValidator(_parser("1/s"))]
Speed = Annotated[float, BeforeValidator(_parser("m/s"))]
Acceleration = Annotated[float, BeforeValidator(_parser("m/s**2"))]
Force = Annotated[float, BeforeValidator(_parser("N"))]
Moment = Annotated[float, BeforeValidator(_parser("N*m"))]
Pressure = Annotated[float, BeforeValidator(_parser("Pa"))]
Density = Annotated[float, BeforeValidator(_parser("kg/m**3"))]
Angle = Annotated[float, BeforeValidator(_parser("rad"))]
Number = Annotated[float, BeforeValidator(_parser("dimensionless"))]
