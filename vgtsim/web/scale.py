"""The colour scale of axial force as a piece of SVG, for pages."""

from __future__ import annotations

import numpy as np

from vgtsim.output.colours import force_colours
from vgtsim.output.quantities import MINUS

_STEPS = 41  # colours of the bar; odd, so that one of them is the grey of no force
_WIDE, _HIGH = 240, 46  # units of the drawing, about pixels


def draw_scale(end: float) -> str:
    """Draw the scale, from compression at the left to tension at the right, with forces in kN; it ends at this force, N."""
    colours = [tuple(row) for row in to_bytes(force_colours(np.linspace(-1, 1, _STEPS), 1.0)).tolist()]
    left, bar = 20, _WIDE - 40
    cells = "".join(
        f'<rect x="{left + k * bar / _STEPS:.2f}" y="14" width="{bar / _STEPS + 0.5:.2f}" height="12" fill="rgb{colour}"/>'
        for k, colour in enumerate(colours)
    )
    ticks = "".join(
        f'<text x="{left + (part + 1) / 2 * bar:.1f}" y="40" text-anchor="middle">{_tell(part * end)}</text>'
        for part in (-1.0, -0.5, 0.0, 0.5, 1.0)
    )
    titles = (
        f'<text x="{left}" y="9">compression</text><text x="{left + bar}" y="9" text-anchor="end">tension, kN</text>'
    )
    label = f"Colours of axial force: compression red, none grey, tension blue, to {end / 1e3:.4g} kN"
    style = 'font-family="sans-serif" font-size="10" fill="currentColor"'
    size = f'width="{_WIDE}" height="{_HIGH}" viewBox="0 0 {_WIDE} {_HIGH}"'
    return f'<svg role="img" aria-label="{label}" {size} {style}>{titles}{cells}{ticks}</svg>'


def to_bytes(colours: np.ndarray) -> np.ndarray:
    """Red, green and blue from 0 to 1, shape (..., 4) with opacity or (..., 3), as whole numbers to 255, shape (..., 3)."""
    return np.round(255 * colours[..., :3]).astype(np.uint8)


def _tell(force: float) -> str:
    return f"{'+' if force > 0 else MINUS if force < 0 else ''}{abs(force) / 1e3:.3g}"
