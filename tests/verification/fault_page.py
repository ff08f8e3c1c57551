"""The page of `docs` that lists the faults: `python tests/verification/fault_page.py` writes it."""

from __future__ import annotations

from pathlib import Path

from cutting_faults import CUT_LOG_FAULTS, CUT_RUN_FAULTS
from faults import LOG_FAULTS, MODEL_FAULTS, RUN_FAULTS
from other_faults import CONTACT_FAULTS, CONTROLLER_FAULTS, ELASTIC_FAULTS, OPERATION_FAULTS, SECTION_FAULTS
from turn_faults import TURN_LOG_FAULTS, TURN_MODEL_FAULTS

PAGE = Path(__file__).parents[2] / "docs" / "faults.md"
PARTS = (
    ("the model", MODEL_FAULTS),
    ("the run", RUN_FAULTS),
    ("the log", LOG_FAULTS),
    ("a run that cuts", CUT_RUN_FAULTS),
    ("a log of it", CUT_LOG_FAULTS),
    ("the model of a mast that turns", TURN_MODEL_FAULTS),
    ("a log of its turn", TURN_LOG_FAULTS),
    ("the model of rigid sections", SECTION_FAULTS),
    ("the description of an elastic arm", ELASTIC_FAULTS),
    ("the controller of an operator", CONTROLLER_FAULTS),
    ("the log of an operator", OPERATION_FAULTS),
    ("the log of a tool that leans on uneven waste", CONTACT_FAULTS),
)


def write_page() -> str:
    """The page of `docs` that lists the faults."""
    lines = [
        "# Faults and the checks that catch them",
        "",
        "`tests/verification/test_faults.py` puts each of these faults into a short run, one at a time. The row of the report",
        "beside the fault must then fail. A fault below the limits has its reason here, and its report must pass. The first runs",
        "are a tour of two goals; runs of other kinds stand further down. This page is made of the lists in",
        "`tests/verification/*faults.py`; a new fault is one more line there.",
        "",
        "| fault | put into | caught by | or below the limits because |",
        "|---|---|---|---|",
    ]
    rows = [f"| {fault.what} | {where} | {fault.caught} | {fault.reason} |" for where, each in PARTS for fault in each]
    return "\n".join([*lines, *rows]) + "\n"


if __name__ == "__main__":
    PAGE.write_text(write_page())
