# SPDX-License-Identifier: MIT
"""A line that kernels are compiled, where nothing counts them: a command that tracks compiles its own beforehand (`kernel_parts`).

In: the first kernel that no cache has (`jit`). Out: one line on standard error, on a terminal. Owns the callback.
"""

from __future__ import annotations

import sys

from echostep.kernel_cache import on_compiling
from echostep_app.printing.lines import complain

COMPILING = "echostep: kernels are compiled, once on this computer: it takes about a minute"


def tell_of_compiling() -> None:
    """Print a line when the first kernel is compiled from now on."""
    on_compiling[:] = [_tell]


def _tell() -> None:
    on_compiling.clear()
    if sys.stderr is not None and sys.stderr.isatty():
        complain(COMPILING)
