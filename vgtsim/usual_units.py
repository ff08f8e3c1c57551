"""Units that are usual in files, as pint measures them: pint itself takes half a second to load, and only others need it."""

from __future__ import annotations

_FORCE = ("kilogram * meter * second**-2", "[length] * [mass] * [time]**-2")
_PRESSURE = ("kilogram * meter**-1 * second**-2", "[length]**-1 * [mass] * [time]**-2")
_FLOW = ("meter**3 * second**-1", "[length]**3 * [time]**-1")
_FREQUENCY = ("second**-1", "[time]**-1")

USUAL_UNITS: dict[str, tuple[float, str, str]] = {  # number of SI base units in one, those units, and the dimension
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
