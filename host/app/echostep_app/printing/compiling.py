# SPDX-License-Identifier: MIT
"""Progress of compiling the kernels: once on a computer, at the first start, for a minute or two.

In: each kernel that no cache has (`jit`). Out: one line on standard error, on a terminal; or a count for the progress that is shown already. Owns
the callback.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from echostep.kernel_cache import on_compiling
from echostep_app.printing.lines import complain

COMPILING = "echostep: kernels are compiled, once on this computer: it takes about a minute"


def tell_of_compiling() -> None:
    """Print a line when the first kernel is compiled from now on."""
    numbers = itertools.count()
    on_compiling[:] = [lambda: _tell(next(numbers))]


def _tell(before: int) -> None:
    if not before and sys.stderr is not None and sys.stderr.isatty():
        complain(COMPILING)


@contextmanager
def counting_compiled(show: Callable[[int], None]) -> Iterator[None]:
    """Give the number of kernels that were compiled in the block, instead of the line."""
    numbers = itertools.count(1)
    on_compiling.append(lambda: show(next(numbers)))
    try:
        yield
    finally:
        on_compiling.pop()
