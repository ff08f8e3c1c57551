"""Types of arrays by what they hold, for annotations; docstrings give shapes and units."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]  # what picks entries of other arrays
Mask = NDArray[np.bool_]
