"""How kernels are compiled.

In: nothing. Out: options for `numba.njit`. Owns nothing.
numba counts references to every array that a kernel hands to another, atomically. In kernels that run once per sample or particle that takes
longer than their work, so those do without: they return numbers or tuples of them, and make no arrays.
"""

from typing import Any

LEAN: dict[str, Any] = {
    "cache": True,
    "error_model": "numpy",
    "_nrt": False,
}  # counts no references, so it must not allocate
ALLOCATES: dict[str, Any] = {**LEAN, "_nrt": True}  # called by a kernel that must not
