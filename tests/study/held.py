"""The command line with a gate: while its file is there, cases that wait at it are in the hands of known processes.

Workers begin with this file as their study does: `multiprocessing` gives them the main program, and Dask's a `--preload`.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

from vgtsim.study import dispatch

FREE = 2  # cases that pass by, the first ones
GATE = "GATE"  # the variable with the path of the file


def hold(order, case, do=dispatch._do_case):
    """Leave a file with the number of this process beside the gate, and wait."""
    gate = Path(os.environ[GATE])
    if case.entries[0] >= FREE and gate.exists():
        gate.with_name(f"{os.getpid()}.held").touch()
        while gate.exists():
            time.sleep(0.01)
    return do(order, case)


dispatch._do_case = hold

if __name__ == "__main__":
    from vgtsim.cli import main

    main()
