"""What a run was made with and what it cost, as rows of the HTML report."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

from vgtsim.description import Tank
from vgtsim.geometry.profile import make_profile
from vgtsim.output.quantities import format_quantity
from vgtsim.site import Site
from vgtsim.verification import Report


def fact_rows(facts: Iterable[tuple[str, str]]) -> str:
    """Write name and value pairs as table rows.

    Args:
        facts: Pairs.
    """
    return "\n".join(f'<tr><th scope="row">{escape(name)}</th><td>{escape(value)}</td></tr>' for name, value in facts)


def list_settings(site: Site) -> list[tuple[str, str]]:
    """List what the run was made with."""
    task, arm = site.task, site.arm
    step, motion = task.simulation, task.motion
    rate = max(arm.cylinders[site.truss.members[i].section].rate for i in site.truss.actuated)
    sizes = f"{len(site.truss.actuated)} actuators, {len(site.truss.nodes)} nodes, {len(site.truss.members)} members"
    return [
        ("scene", f"{task.name} ({site.scene.file.name})"),
        ("arm", f"{arm.title}: {sizes}"),
        ("tank", site.tank.title),
        ("waste", describe_waste(site.tank)),
        ("pivot", f"{format_quantity(site.scene.pivot_height, 'm')} above the lowest floor point"),
        ("payload", f"{task.payload.mass:.4g} kg"),
        ("time step", format_quantity(step.timestep * 1e3, "ms")),
        ("records", f"{step.log_rate:.4g} a second"),
        ("drive", step.drive),
        ("gravity", f"{step.gravity:.5g} m/s²"),
        ("factor on inverse weights", format_quantity(step.weight_scale, "")),
        ("actuator speed", f"{format_quantity(motion.rate_fraction * rate, 'm')}/s at most"),
        ("actuator acceleration", f"{format_quantity(motion.acceleration, 'm')}/s² at most"),
        ("planned stroke margin", format_quantity(motion.stroke_margin, "m")),
        ("planned clearance", format_quantity(motion.clearance, "m")),
        ("settled below", f"{format_quantity(motion.settle_speed, 'm')}/s at every node"),
        ("safety factor on member strength", f"{task.limits.safety_factor:.4g}"),
    ]


def describe_waste(tank: Tank) -> str:
    """What is left in a tank, how much of it, and how high it stands."""
    waste, volume = tank.waste, make_profile(tank.shell).volume(tank.waste.level)
    tonnes = waste.density * volume / 1000
    return f"{waste.kind}, {volume:.3g} m³, {tonnes:.3g} t, standing at {format_quantity(waste.level, 'm')}"


def list_costs(report: Report) -> list[tuple[str, str]]:
    """List what the run cost."""
    words = {
        "simulated_s": ("simulated time", "{:.2f} s"),
        "wall_s": ("wall time", "{:.2f} s"),
        "real_time_factor": ("times real time", "{:.3g}"),
        "steps": ("steps", "{:.0f}"),
        "nv": ("degrees of freedom before constraints", "{:.0f}"),
    }
    return [
        (words[name][0], words[name][1].format(value)) if name in words else (name, f"{value:.6g}")
        for name, value in report.performance.items()
    ]
