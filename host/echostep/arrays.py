"""Types of numpy arrays that annotations use everywhere.

In: nothing. Out: names of array types. Owns nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Int32s = NDArray[np.int32]
Bools = NDArray[np.bool_]
Octets = NDArray[np.uint8]
