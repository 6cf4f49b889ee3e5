"""How kernels are compiled.

In: nothing. Out: options for `numba.njit`. Owns nothing.
numba counts references to every array that a kernel hands to another, atomically. In kernels that run once per sample or particle that takes
longer than their work, so those do without: they return numbers or tuples of them, and make no arrays.
"""

from __future__ import annotations

import sys
from typing import Any

from numba.np import linalg

LEAN: dict[str, Any] = {
    "cache": True,
    "error_model": "numpy",
    "_nrt": False,
}  # counts no references, so it must not allocate
ALLOCATES: dict[str, Any] = {**LEAN, "_nrt": True}  # called by a kernel that must not


def _put_off_blas() -> None:
    """Load the part of numba that looks for BLAS by loading scipy's, 0.15 s, and let it look when a kernel asks for it; none of ours does."""
    look = getattr(linalg, "ensure_blas", None)
    if look is None or "numba.np.arraymath" in sys.modules:
        return
    linalg.ensure_blas = lambda: None
    try:
        from numba.np import arraymath  # noqa: F401
    finally:
        linalg.ensure_blas = look


_put_off_blas()
