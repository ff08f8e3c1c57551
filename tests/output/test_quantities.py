"""Figures as people write them."""

import math

import pytest

from vgtsim.output.quantities import format_quantity


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (3.21e-8, "m", "32.1 nm"),
        (9.999e-7, "m", "1 µm"),
        (1e-6, "m", "1 µm"),
        (0.0312, "m", "31.2 mm"),
        (13.716, "m", "13.7 m"),
        (1234.5, "m", "1234 m"),
        (0.0, "m", "0 m"),
        (416896.6, "N", "417 kN"),
        (4e-9, "N·m", "4 nN·m"),
        (4e-9, "N*m", "4 nN·m"),
        (math.radians(0.1), "rad", "0.1°"),
        (1e-6, "1", "10⁻⁶"),
        (4.2e-10, "", "4.2·10⁻¹⁰"),
        (0.93, "1", "0.93"),
        (3, "contacts", "3 contacts"),
        (math.nan, "m", "not measured"),
    ],
)
def test_three_digits_and_a_fitting_unit(value, unit, text):
    assert format_quantity(value, unit) == text


def test_a_negative_figure_differs_by_its_sign_only():
    assert format_quantity(-416896.6, "N") == "\N{MINUS SIGN}" + format_quantity(416896.6, "N")
