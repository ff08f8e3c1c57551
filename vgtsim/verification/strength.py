"""How much of the members' strength the run and the load cases use."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vgtsim.kinematics import first_greatest
from vgtsim.statics import MODES, SLENDERNESS_ADVICE
from vgtsim.verification.evidence import Array, Evidence
from vgtsim.verification.measures import Finding, has_cases, report_as, worst_of


@report_as("member_utilisation", "force over strength", unit="1", limit="member_utilisation")
def check_utilisation(run: Evidence) -> Finding:
    """Greatest demand over strength, with the mode that governs and the margin that is left."""
    used, slender = run.use.strength, run.ratings.slenderness
    found = worst_of(used, run.log.time, run.names)
    if not np.isfinite(found.value):
        return found
    record, member = np.unravel_index(np.nanargmax(used), used.shape)
    mode = MODES[int(first_greatest(run.use.by_mode[:, record, member]))]
    text = f"governed by {mode}, KL/r {slender[record, member]:.0f}, margin {_margin(found.value):.3g}"
    if (most := float(np.nanmax(slender))) > SLENDERNESS_ADVICE:
        name = run.names[int(np.nanargmax(np.nanmax(slender, axis=0)))]
        text += f"; {name} has KL/r {most:.0f}, more than the {SLENDERNESS_ADVICE:.0f} that AISC 360 E2 advises"
    return replace(found, detail=text)


@report_as(
    "member_utilisation", "force over strength, load cases", unit="1", limit="member_utilisation", applies=has_cases
)
def check_case_strength(run: Evidence) -> Finding:
    """Greatest part of the strength used in any load case at any recorded pose."""
    return find_worst_case(run, run.envelope.strength)


def find_worst_case(run: Evidence, used: Array) -> Finding:
    """Worst of demands over capacity, shape (C, T, M), with its load case and margin."""
    case, *_ = np.unravel_index(first_greatest(used), used.shape)
    found = worst_of(used[case], run.log.time[run.case_records], run.names)
    return replace(found, detail=f"case {run.envelope.cases[int(case)]}, margin {_margin(found.value):.3g}")


def _margin(used: float) -> float:
    """Part by which a demand could grow."""
    return 1 / used - 1 if used else float("inf")
