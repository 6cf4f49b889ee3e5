# SPDX-License-Identifier: MIT
"""Where the public recordings are.

In: $ECHOSTEP_DATA. Out: `DATA`. Owns nothing.
"""

from __future__ import annotations

import os
from pathlib import Path

DATA = Path(os.environ.get("ECHOSTEP_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
