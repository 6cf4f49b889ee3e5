# SPDX-License-Identifier: MIT
"""Compile the kernels of tracker and simulation, once for all runs of the tests: else each worker of a parallel run would compile them.

In: nothing. Out: kernels in the cache, for this state of the sources; on a terminal the share that is done. Owns nothing.
"""

from __future__ import annotations

from echostep_app.kernel_parts import LATER, TRACKING, compile_parts
from echostep_app.printing.progress import progress_line
from echostep_app.session.runs.demo import SIMULATION


def main() -> None:
    """Compile what is not compiled yet."""
    with progress_line("Compiling kernels, once for these sources") as show:
        compile_parts([*TRACKING, SIMULATION, *LATER], show)


if __name__ == "__main__":
    main()
