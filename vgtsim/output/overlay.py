"""Text and the scale bar on the film's frames."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from vgtsim.output.colours import force_colours
from vgtsim.output.quantities import MINUS
from vgtsim.output.readings import READINGS

Picture = NDArray[np.uint8]

LABELS = ("time", *READINGS)
_GROUND = (14, 18, 24, 215)
_SOFT = (170, 178, 188, 255)
_INK = (242, 244, 246, 255)
_ACTIVE = (110, 240, 150)
_THING = (214, 206, 178)  # names of what stands in the tank
_LEAST_FONT = 9  # pixels; smaller letters cannot be read
_HALO = 2  # pixels of dark rim around a goal's name


@dataclass(frozen=True)
class Mark:
    """A name to write at a place in the picture, pixels; the active one is the one to look at, and has a ring."""

    text: str
    column: float
    row: float
    active: bool


@dataclass(frozen=True)
class Overlay:
    """What stays the same on every frame.

    Attributes:
        pieces: Panel, scale bar and title, with opacity, and the column and row of their upper left corners.
        unit: Height of the letters, pixels; every other distance is a multiple.
        font: For the panel.
        values: Column and row of each value in the panel, pixels.
        names: Every name as it is usually, and as that of the goal that is approached.
    """

    pieces: tuple[tuple[Image.Image, tuple[int, int]], ...]
    unit: int
    font: ImageFont.FreeTypeFont
    values: tuple[tuple[int, int], ...]
    names: dict[str, tuple[Image.Image, Image.Image]]


def make_overlay(
    width: int,
    height: int,
    title: str,
    end: float,
    goals: Iterable[str] = (),
    things: Iterable[str] = (),
    labels: tuple[str, ...] = LABELS,
) -> Overlay:
    """Draw the static parts once, for frames of a size in pixels; the scale of axial force ends at `end`, N.

    Only the names of these goals and things can be written.
    """
    unit = max(_LEAST_FONT, round(height / 36))
    folder, less = Path(mpl.get_data_path()) / "fonts" / "ttf", max(_LEAST_FONT, round(0.8 * unit))
    font, small = (ImageFont.truetype(folder / "DejaVuSans.ttf", size) for size in (unit, less))
    bold = ImageFont.truetype(folder / "DejaVuSans-Bold.ttf", less)
    layer = Image.new("RGBA", (width, height), (0, 0, 0, 0))
    draw = ImageDraw.Draw(layer)
    left, top, step = unit, unit, round(1.45 * unit)
    panel = (left // 2, top // 2, left + 20 * unit, top + step * len(labels) + unit // 3)
    draw.rounded_rectangle(panel, unit // 2, fill=_GROUND)
    rows = [top + step * index for index in range(len(labels))]
    for label, row in zip(labels, rows, strict=True):
        draw.text((left + unit // 4, row), label, font=font, fill=_SOFT)
    long = round(bold.getlength(title))
    foot = (left // 2, height - round(2.2 * unit), left + long + unit // 2, height - unit // 2)
    draw.rounded_rectangle(foot, unit // 2, fill=_GROUND)
    draw.text((left, (foot[1] + foot[3]) // 2), title, font=bold, fill=_INK, anchor="lm")
    scale = _draw_scale(layer, draw, small, unit, end)
    pieces = tuple((layer.crop((a, b, c + 1, d + 1)), (a, b)) for a, b, c, d in (panel, scale, foot))
    values = tuple((left + round(8.3 * unit), row) for row in rows)
    drawn = ((thing, _draw_name(thing, small, _THING)) for thing in things)
    names = {thing: (name, name) for thing, name in drawn}
    names |= {goal: (_draw_name(goal, small, _INK), _draw_name(goal, small, _ACTIVE)) for goal in goals}
    return Overlay(pieces, unit, font, values, names)


def _draw_name(name: str, font: ImageFont.FreeTypeFont, ink: tuple[int, ...]) -> Image.Image:
    """Draw a name with its rim; its upper left corner is that of the letters' line."""
    _, _, right, bottom = font.getbbox(name, stroke_width=_HALO)
    image = Image.new("RGBA", (int(right) + 1, int(bottom) + 1), (0, 0, 0, 0))
    ImageDraw.Draw(image).text((0, 0), name, font=font, fill=ink, stroke_width=_HALO, stroke_fill=_GROUND[:3])
    return image


def _draw_scale(
    layer: Image.Image, draw: ImageDraw.ImageDraw, font: ImageFont.FreeTypeFont, unit: int, end: float
) -> tuple[int, int, int, int]:
    """Draw the signed bar at the right, tension above; returns its box."""
    thick, tall = round(1.2 * unit), min(round(15 * unit), layer.height - 6 * unit)
    left, top = layer.width - round(6.6 * unit), (layer.height - tall) // 2
    box = (left - unit, top - round(2.4 * unit), layer.width - unit // 2, top + tall + round(2.6 * unit))
    draw.rounded_rectangle(box, unit // 2, fill=_GROUND)
    colours = (255 * force_colours(np.linspace(1, -1, tall), 1.0)).astype(np.uint8)
    layer.paste(Image.fromarray(np.repeat(colours[:, None], thick, axis=1)), (left, top))
    for part, sign in ((1.0, "+"), (0.5, "+"), (0.0, ""), (-0.5, MINUS), (-1.0, MINUS)):
        row = top + round((1 - part) / 2 * (tall - 1))
        draw.line((left + thick, row, left + thick + unit // 3, row), fill=_INK, width=max(1, unit // 12))
        text = f"{sign}{abs(part) * end / 1e3:.4g}"
        draw.text((left + thick + unit // 2, row), text, font=font, fill=_INK, anchor="lm")
    middle = (box[0] + box[2]) // 2
    draw.text((middle, top - round(1.3 * unit)), "tension, kN", font=font, fill=_INK, anchor="mm")
    draw.text((middle, top + tall + round(1.4 * unit)), "compression", font=font, fill=_INK, anchor="mm")
    return box


def draw_overlay(overlay: Overlay, frame: Picture, values: tuple[str, ...], marks: tuple[Mark, ...]) -> Picture:
    """Put the overlay and the texts of one instant onto a frame, shape (height, width, 3), and give the result.

    There is one value for each label. Marks outside the picture are left out.
    """
    image = Image.fromarray(frame)
    draw = ImageDraw.Draw(image)
    shift = 0.7 * overlay.unit
    for mark in marks:
        if 0 <= mark.column < image.width and 0 <= mark.row < image.height:
            name = overlay.names[mark.text][mark.active]
            image.paste(name, (round(mark.column + shift), round(mark.row - shift)), name)
            if mark.active:
                draw.circle((mark.column, mark.row), 0.6 * overlay.unit, outline=_ACTIVE, width=_HALO)
    for piece, corner in overlay.pieces:
        image.paste(piece, corner, piece)
    for text, place in zip(values, overlay.values, strict=True):
        draw.text(place, text, font=overlay.font, fill=_INK[:3])
    return np.asarray(image)
