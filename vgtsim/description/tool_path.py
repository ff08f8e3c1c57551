"""A path of the tool: lines, arcs, splines and rasters one after the other."""

from __future__ import annotations

from math import hypot
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from vgtsim.description.scene import Vector
from vgtsim.description.schema import Description, Name
from vgtsim.units import Acceleration, Angle, Length, Number, Speed


def _not_zero(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if hypot(*value) < 1e-9:
        raise ValueError("a vector that is not zero")
    return value


Heading = Annotated[tuple[Number, Number, Number], AfterValidator(_not_zero)]


class LinePiece(Description):
    """A straight line from where the last piece ended.

    Attributes:
        shape: `line`.
        to: Its end in frame G, m.
        direction: Of the tool at its end, turned to evenly on the way; absent to keep it.
    """

    shape: Literal["line"]
    to: Vector
    direction: Heading | None = None


class ArcPiece(Description):
    """A circular arc from where the last piece ended.

    Attributes:
        shape: `arc`.
        centre: A point of its axis in frame G, m.
        axis: Direction of the axis.
        angle: Turned about it, rad.
        direction: Of the tool at its end, turned to evenly on the way; absent to keep it.
    """

    shape: Literal["arc"]
    centre: Vector
    axis: Heading
    angle: Angle
    direction: Heading | None = None


class SplinePiece(Description):
    """A cubic spline from where the last piece ended, through way-points.

    Attributes:
        shape: `spline`.
        through: Way-points in frame G, m; it ends at the last.
        direction: Of the tool at its end, turned to evenly on the way; absent to keep it.
    """

    shape: Literal["spline"]
    through: tuple[Vector, ...] = Field(min_length=1)
    direction: Heading | None = None


class RasterPiece(Description):
    """Rows to and fro over a parallelogram, from where the last piece ended; the tool keeps its direction.

    Attributes:
        shape: `raster`.
        width: Along the first row in frame G, m.
        depth: Across all rows in frame G, m.
        rows: Number of rows.
    """

    shape: Literal["raster"]
    width: Annotated[Vector, AfterValidator(_not_zero)]
    depth: Annotated[Vector, AfterValidator(_not_zero)]
    rows: int = Field(ge=2)


Piece = Annotated[LinePiece | ArcPiece | SplinePiece | RasterPiece, Field(discriminator="shape")]
SHAPES = ("line", "arc", "spline", "raster")


class ToolPath(Description):
    """A path as written.

    Attributes:
        name: Short name.
        start: Tool point at its beginning, in frame G, m.
        direction: Outward normal of the tip plate there, in frame G.
        tolerance: Greatest distance of the tool from the path between two goals, m; and of its direction, rad.
        rate_fraction: Part of the cylinders' rated speed that may be used.
        acceleration: Greatest acceleration of a cylinder, m/s².
        speed: Greatest speed of the tool point, m/s; absent for whatever the cylinders allow.
        pieces: In order; the arm rests where one ends and the next begins.
    """

    name: Name
    start: Vector
    direction: Heading
    tolerance: Length = Field(default=1e-4, gt=0)
    rate_fraction: Number = Field(default=0.8, gt=0, le=1)
    acceleration: Acceleration = Field(default=0.05, gt=0)
    speed: Speed | None = Field(default=None, gt=0)
    pieces: tuple[Piece, ...] = Field(min_length=1)
