"""Figures as people write them: three digits and an engineering unit."""

from __future__ import annotations

from math import degrees, floor, isfinite, log10

MINUS = "\N{MINUS SIGN}"

_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
_PREFIXED = {"m": "m", "s": "s", "N": "N", "N·m": "N·m", "N*m": "N·m", "Nm": "N·m", "Pa": "Pa"}
_PLAIN = ("", "1", "-", "dimensionless", "ratio")


def format_quantity(value: float, unit: str) -> str:
    """Write a figure in an SI unit with three digits, such as `3.2 µm`, `417 kN`, `0.1°`.

    Lengths, forces, moments and pressures get a prefix, angles become degrees. A figure that is not finite gives
    `not measured`.
    """
    if not isfinite(value):
        return "not measured"
    if value < 0:
        return f"{MINUS}{format_quantity(-value, unit)}"
    if unit == "rad":
        return f"{_digits(degrees(value))}°"
    if unit in _PREFIXED:
        return _prefixed(value, _PREFIXED[unit])
    return _digits(value) if unit in _PLAIN else f"{_digits(value)} {unit}"


def _prefixed(value: float, unit: str) -> str:
    """Write a figure that is not negative with a prefix."""
    if value == 0:
        return f"0 {unit}"
    largest = 0 if unit in ("m", "s") else 9  # nobody writes km in a tank
    exponent = 3 * floor(log10(float(f"{value:.3g}")) / 3)
    exponent = min(max(exponent, -12), largest)
    return f"{_digits(value / 10.0**exponent)} {_PREFIXES[exponent]}{unit}"


def _digits(value: float) -> str:
    if value == 0:
        return "0"
    if 1e-3 <= value < 1e5:
        places = max(0, 2 - floor(log10(float(f"{value:.3g}"))))
        text = f"{value:.{places}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    mantissa, exponent = f"{value:.2e}".split("e")
    power = "10" + str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    mantissa = mantissa.rstrip("0").rstrip(".")
    return power if mantissa == "1" else f"{mantissa}·{power}"
