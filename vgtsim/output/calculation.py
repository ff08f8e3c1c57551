"""The calculation sheet of the member that is used most: every formula with its figures and its clause."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import Cylinder, Tube
from vgtsim.output.quantities import MINUS, format_quantity
from vgtsim.output.truss_plot import worst_instant
from vgtsim.site import Site
from vgtsim.statics import ROD_FACTOR, effective_area, elastic_stress, is_inelastic, rate, rod_buckling
from vgtsim.verification import JudgedRun

_MM2 = 1e-6  # m², as sections of members are written
_CODE = "AISC 360-22"
# A line of a calculation: what it is, the formula, its value as text, and where the formula comes from.
SheetLine = tuple[str, str, str, str]


@dataclass(frozen=True, kw_only=True)
class CalculationSheet:
    """The strength of one member at its worst instant, s; `used` is the greatest of demand over capacity."""

    member: str
    section: str
    when: float
    mode: str
    used: float
    lines: tuple[SheetLine, ...]


def make_sheet(run: JudgedRun) -> CalculationSheet | None:
    """Write the calculation of the member that is used most; absent where the report has no utilisation.

    Demands are those of the report: the greatest tension and compression along the member.
    """
    site, series = run.site, run.report.series
    if not np.isfinite(series.get("utilisation", np.nan)).any():
        return None
    record, index = worst_instant(run)
    member = site.truss.members[index]
    arm, sections = site.arm, site.sections
    part = arm.cylinders[member.section] if member.role == "actuator" else arm.tubes[member.section]
    lengths = site.truss.lengths(run.log.nodes[record])
    limits = rate(sections, lengths, site.safety_factor).limits
    allowed = {name: _pick(pair, index, lengths.shape) for name, pair in limits.items()}
    pulled, pushed = (float(series[f"utilisation_{kind}"][record, index]) for kind in ("tension", "compression"))
    demand = (pulled * allowed["yield"][0], pushed * min(allowed["column"][1], allowed["rod buckling"][1]))
    shares = {
        name: max(force / limit for force, limit in zip(demand, limits, strict=True))
        for name, limits in allowed.items()
        if name != "oil pressure"  # the drive's capacity, which is judged apart
    }
    used = float(series["utilisation"][record, index])
    mode = max(shares, key=lambda name: shares[name])
    if shares[mode] < used * (1 - 1e-9):  # rounding apart, bending by joint blocks is the rest
        mode = "axial force with bending"
    steel = float(sections.yield_strength[index]), float(sections.youngs_modulus[index])
    lines = [
        *(_describe_tube(part, arm.materials[part.material].design_wall) if isinstance(part, Tube) else []),
        *([("rod", "d", format_quantity(part.rod, "m"), "section")] if isinstance(part, Cylinder) else []),
        *_list_column(site, index, float(lengths[index]), steel, allowed),
        *(_list_cylinder(part, steel, float(lengths[index]), allowed) if isinstance(part, Cylinder) else []),
        *_list_demand(demand, shares),
    ]
    return CalculationSheet(
        member=member.name,
        section=member.section,
        when=float(run.log.time[record]),
        mode=mode,
        used=used,
        lines=tuple(lines),
    )


def _pick(pair: tuple[Array, Array], index: int, shape: tuple[int, ...]) -> tuple[float, float]:
    """Pull and push of one member."""
    pull, push = (float(np.broadcast_to(side, shape)[index]) for side in pair)
    return pull, push


def _describe_tube(tube: Tube, design: float) -> list[SheetLine]:
    wall = f"{design:.3g} · {format_quantity(tube.wall, 'm')}"
    return [
        ("outer diameter", "D", format_quantity(tube.outer_diameter, "m"), "section"),
        ("design wall", f"t = {wall}", format_quantity(design * tube.wall, "m"), f"{_CODE} B4.2"),
        ("slimness", "D / t", f"{tube.outer_diameter / (design * tube.wall):.3g}", "section"),
    ]


def _list_column(
    site: Site, index: int, length: float, steel: tuple[float, float], allowed: dict[str, tuple[float, float]]
) -> list[SheetLine]:
    """Lines of tension and column strength."""
    sections, omega = site.sections, site.safety_factor
    fy, modulus = steel
    area, radius = float(sections.area[index]), float(sections.gyration_radius[index])
    counted = float(effective_area(area, np.broadcast_to(sections.slimness, sections.area.shape)[index], *steel))
    slenderness = length / radius
    euler, inelastic = elastic_stress(slenderness, modulus), is_inelastic(slenderness, fy, modulus)
    column = "0.658^(Fy/Fe) Fy" if inelastic else "0.877 Fe"
    critical = allowed["column"][1] * omega / counted
    pascals = f"{fy / 1e6:.4g} MPa", f"{modulus / 1e9:.4g} GPa"
    return [
        ("steel", f"Fy = {pascals[0]}, E = {pascals[1]}", "", "material of the section"),
        ("area", "A", f"{area / _MM2:.4g} mm²", "section"),
        ("length from hub to hub", "L", format_quantity(length, "m"), "the pose of this instant"),
        ("slenderness", f"K L / r, K = 1, r = {format_quantity(radius, 'm')}", f"{slenderness:.3g}", f"{_CODE} E2"),
        ("area that counts in compression", "Ae", f"{counted / _MM2:.4g} mm²", f"{_CODE} E7-6, E7-7"),
        ("elastic buckling stress", "Fe = π² E / (K L / r)²", f"{euler / 1e6:.4g} MPa", f"{_CODE} E3-4"),
        ("critical stress", f"Fcr = {column}", f"{critical / 1e6:.4g} MPa", f"{_CODE} E3-{2 if inelastic else 3}"),
        (
            "allowable compression",
            f"Fcr Ae / Ω, Ω = {omega:.4g}",
            format_quantity(allowed["column"][1], "N"),
            f"{_CODE} E3-1, E7-1",
        ),
        ("allowable tension", "Fy A / Ω", format_quantity(allowed["yield"][0], "N"), f"{_CODE} D2-1"),
    ]


def _list_cylinder(
    cylinder: Cylinder, steel: tuple[float, float], length: float, allowed: dict[str, tuple[float, float]]
) -> list[SheetLine]:
    """Lines that a cylinder has beside those of its rod as a column."""
    euler = float(rod_buckling(cylinder.rod, steel[1], length))
    lines = [
        ("Euler load of the rod", "π² E (π d⁴ / 64) / L²", format_quantity(euler, "N"), "Euler, pinned ends"),
        (
            "allowable compression of the rod",
            f"Euler load / {ROD_FACTOR:g}",
            format_quantity(allowed["rod buckling"][1], "N"),
            "cylinder makers' factor, 3 to 5",
        ),
        (
            "push at supply pressure",
            f"p π D² / 4, D = {format_quantity(cylinder.bore, 'm')}",
            format_quantity(cylinder.push, "N"),
            "pressure on the bore",
        ),
        (
            "pull at supply pressure",
            f"p π (D² {MINUS} d²) / 4",
            format_quantity(cylinder.pull, "N"),
            "pressure on the annulus",
        ),
    ]
    if np.isfinite(allowed["pin shear"][0]):
        lines.append(
            (
                "allowable force of the pins",
                "2 · 0.6 Fy (π d² / 4) / Ω",
                format_quantity(allowed["pin shear"][0], "N"),
                f"{_CODE} J4-3",
            )
        )
    return lines


def _list_demand(demand: tuple[float, float], shares: dict[str, float]) -> list[SheetLine]:
    """Lines of the demands and of how much of each strength they use."""
    words = zip(("greatest tension along the member", "greatest compression along the member"), demand, strict=True)
    lines = [
        (name, "measured", format_quantity(force, "N"), "the run, with weight and inertia")
        for name, force in words
        if force > 0
    ]
    return lines + [
        (f"use by {name}", "demand / allowable", f"{share:.3f}", "") for name, share in shares.items() if share > 0
    ]
