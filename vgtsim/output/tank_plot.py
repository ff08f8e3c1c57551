"""The tank as an outline, from the side and from above."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle

from vgtsim.description.tank import Equipment, Tank
from vgtsim.geometry.profile import make_profile
from vgtsim.output.colours import REST

WASTE = "#a9803f"
_SPACING = 0.05  # m between the points of the outline


def draw_tank_side(axes: Axes, tank: Tank, azimuth: float) -> None:
    """Draw the tank cut by a vertical plane through its axis.

    Args:
        axes: Abscissa along the plane, ordinate z, m.
        azimuth: Of the plane from +x, rad; equipment is projected onto it.
    """
    profile = make_profile(tank.shell)
    r, z = profile.points(_SPACING).T
    bore, top = tank.arm_riser.bore / 2, tank.grade
    wet = z <= tank.waste.level
    level = np.append(z[wet], tank.waste.level)
    width = np.append(r[wet], np.interp(tank.waste.level, z, r))
    axes.fill_betweenx(level, -width, width, color=WASTE, alpha=0.45, linewidth=0)
    open_ = r >= bore
    for side in (-1, 1):
        axes.plot(side * r[~open_ & (z < tank.shell.crown / 2)], z[~open_ & (z < tank.shell.crown / 2)], color=REST)
        axes.plot(side * r[open_], z[open_], color=REST, linewidth=1.4)
        axes.plot([side * bore] * 2, [float(profile.ceiling_at(bore)), top], color=REST, linewidth=1.4)
        axes.plot([side * bore, side * 1.15 * tank.shell.inner_diameter / 2], [top, top], color=REST, linestyle=":")
    axes.text(-tank.shell.inner_diameter / 2, top + 0.1, "grade", color=REST, fontsize=7.5, va="bottom")
    for item in tank.equipment:
        across = item.radius * np.cos(item.azimuth - azimuth)
        crown = float(profile.ceiling_at(item.radius)) if item.top is None else item.top
        corner, height = (across - item.diameter / 2, item.bottom), crown - item.bottom
        axes.add_patch(Rectangle(corner, item.diameter, height, facecolor=REST, alpha=0.45, linewidth=0))


def draw_tank_top(axes: Axes, tank: Tank) -> None:
    """Draw the wall, the arm's riser and the equipment from above.

    Args:
        axes: Abscissa x, ordinate y, m.
    """
    axes.add_patch(Circle((0, 0), tank.shell.inner_diameter / 2, fill=False, edgecolor=REST, linewidth=1.4))
    axes.add_patch(Circle((0, 0), tank.arm_riser.bore / 2, fill=False, edgecolor=REST, linestyle=":"))
    for item in tank.equipment:
        x, y = _centre(item)
        axes.add_patch(Circle((x, y), max(item.diameter / 2, 0.08), facecolor=REST, alpha=0.7, linewidth=0))
        name = item.name.replace("_", " ")
        axes.annotate(name, (x, y), (4, 4), textcoords="offset points", fontsize=7, color=REST)


def _centre(item: Equipment) -> tuple[float, float]:
    return item.radius * float(np.cos(item.azimuth)), item.radius * float(np.sin(item.azimuth))
