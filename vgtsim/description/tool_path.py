"""A path of the tool: lines, arcs, splines and rasters in sequence.

Each piece starts at the end of the piece before it. The tool turns evenly to the `direction` at the end of a piece, and keeps
its direction where none is given. Points and directions are in frame G.
"""

from __future__ import annotations

from math import hypot
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from vgtsim.description.figures import Acceleration, Angle, Number, Speed, Tolerance
from vgtsim.description.motion import Vector
from vgtsim.description.schema import Description, Name


def _not_zero(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if hypot(*value) < 1e-9:  # rounding of a figure such as "0 m", not a short vector
        raise ValueError("a vector that is not zero")
    return value


Heading = Annotated[tuple[Number, Number, Number], AfterValidator(_not_zero)]


class LinePiece(Description):
    """A straight line to the point `to`."""

    shape: Literal["line"]
    to: Vector
    direction: Heading | None = None


class ArcPiece(Description):
    """A circular arc: a turn by `angle` about the axis through `centre`."""

    shape: Literal["arc"]
    centre: Vector
    axis: Heading
    angle: Angle
    direction: Heading | None = None


class SplinePiece(Description):
    """A cubic spline through way-points; it ends at the last one."""

    shape: Literal["spline"]
    through: tuple[Vector, ...] = Field(min_length=1, max_length=1000)
    direction: Heading | None = None


class RasterPiece(Description):
    """Rows to and fro over a parallelogram of sides `width`, along a row, and `depth`; the tool keeps its direction."""

    shape: Literal["raster"]
    width: Annotated[Vector, AfterValidator(_not_zero)]
    depth: Annotated[Vector, AfterValidator(_not_zero)]
    rows: int = Field(ge=2, le=1000)


Piece = Annotated[LinePiece | ArcPiece | SplinePiece | RasterPiece, Field(discriminator="shape")]
SHAPES = ("line", "arc", "spline", "raster")


class ToolPath(Description):
    """A path as written, from a tool point and an outward normal of the tip plate; the arm rests after each piece.

    Attributes:
        tolerance: Greatest distance of the tool from the path between two goals, m, and of its direction, rad.
        rate_fraction: Part of the cylinders' rated speed that may be used.
        acceleration: Greatest acceleration of a cylinder.
        speed: Greatest speed of the tool point; absent for the speed that the cylinders allow.
    """

    name: Name
    start: Vector
    direction: Heading
    tolerance: Tolerance = 1e-4
    rate_fraction: Number = Field(default=0.8, gt=0, ge=1e-3, le=1)
    acceleration: Acceleration = Field(default=0.05, gt=0)
    speed: Speed | None = None
    pieces: tuple[Piece, ...] = Field(min_length=1, max_length=1000)
