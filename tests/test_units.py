"""Quantities as users write them."""

from __future__ import annotations

import pytest

from vgtsim.units import to_si


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("42 in", "m", 1.0668),
        ("45 ft", "m", 13.716),
        ("1000 lbf", "N", 4448.2216152605),
        ("1000 lb", "kg", 453.59237),
        ("3000 psi", "Pa", 20684271.8795),
        ("180 deg", "rad", 3.14159265358979),
        (2, "m", 2.0),
        (0.5, "dimensionless", 0.5),
    ],
)
def test_quantities_convert_exactly(text, unit, value):
    assert to_si(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        ("45 kg", "m", "dimension"),
        ("45", "m", "dimension"),
        ("forty", "m", "not a quantity"),
        ("9.8 m/s**2/0", "m/s**2", "not a quantity"),
        (float("nan"), "m", "finite"),
        ("inf m", "m", "finite"),
        (True, "m", "quantity"),
        ([1], "m", "quantity"),
    ],
)
def test_what_is_no_such_quantity_is_refused(value, unit, words):
    with pytest.raises(ValueError, match=words):
        to_si(value, unit)
