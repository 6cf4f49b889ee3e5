# SPDX-License-Identifier: MIT
"""The kernels of a run, compiled before its first bytes come: once on a computer, in as many processes as there are cores.

In: parts, each a function that calls its kernels once (`echostep.tracker.kernels`). Out: kernels in the cache (`kernel_cache`), from which every
process loads them. Owns the processes, and a mark in the folder of the kernels for each compiled part.
"""

from __future__ import annotations

import gc
import itertools
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from pkgutil import resolve_name
from typing import NamedTuple

import numba
from numba.core import event

from echostep.kernel_cache import cache_folder

PARTS = "echostep.tracker.kernels"
PREPARING = "preparing (kernels are compiled once on a computer)"  # with a share it fits 80 columns
LOW_PRIORITY = 19  # niceness: a run that goes on meanwhile comes first
Show = Callable[[float], None]  # told of the share that is done


class Part(NamedTuple):
    """`module:function`, and about how many kernels it compiles."""

    function: str
    kernels: int

    @property
    def mark(self) -> Path | None:
        """The file that says that these sources, this Python and this numba have compiled the part; None: there is no cache."""
        module, _, name = self.function.partition(":")
        spec = find_spec(module)
        folder = cache_folder(spec.origin) if spec and spec.origin else None
        return folder and folder / f"{name}-{platform.python_version()}-{numba.__version__}"

    @property
    def is_compiled(self) -> bool:
        """Whether its kernels are in the cache."""
        return self.mark is not None and self.mark.exists()


WALLS = Part(f"{PARTS}:walls", 112)
FOOT = Part(f"{PARTS}:foot", 91)
BOARD_AND_CLOCKS = Part(f"{PARTS}:board_and_clocks", 60)
CLOUD = Part(f"{PARTS}:cloud", 27)
SEARCH = Part(f"{PARTS}:search", 40)
BEACONS = Part(f"{PARTS}:beacons", 75)
TRACKING = (WALLS, FOOT, BOARD_AND_CLOCKS, CLOUD)  # the longest first
LATER = (SEARCH, BEACONS)  # what a walk from a known start may come to need


def compile_parts(parts: Sequence[Part], *shows: Show) -> None:
    """Compile the parts that are not in the cache, in a process for each core. A part that fails is compiled by the run when it is first called."""
    shares = _shared_out([part for part in parts if not part.is_compiled], os.cpu_count() or 1)
    count, total = itertools.count(1), sum(part.kernels for share in shares for part in share)
    children: list[subprocess.Popen[bytes]] = []

    def compile_share(share: Sequence[Part]) -> None:
        with suppress(OSError), start_compiling(share) as child:
            children.append(child)
            while child.stdout is not None and child.stdout.read(1):
                done = min(next(count) / total, 1.0)
                for show in shows:
                    show(done)

    with ThreadPoolExecutor(max(len(shares), 1)) as pool:
        try:
            list(pool.map(compile_share, shares))
        except BaseException:
            for child in children:
                child.kill()
            raise


def _shared_out(parts: Sequence[Part], count: int) -> list[list[Part]]:
    """The parts for each of at most `count` processes: each to the one that has least to do so far. What two parts share is then compiled once."""
    shares: list[list[Part]] = [[] for _ in range(min(count, len(parts)))]
    for part in sorted(parts, key=lambda part: -part.kernels):
        min(shares, key=lambda share: sum(one.kernels for one in share)).append(part)
    return shares


@contextmanager
def compiling_later(parts: Sequence[Part]) -> Iterator[subprocess.Popen[bytes] | None]:
    """Compile these parts in a process of low priority while the block runs; None where nothing is to be done."""
    waiting = [part for part in parts if not part.is_compiled]
    child = start_compiling(waiting, LOW_PRIORITY) if waiting else None
    try:
        yield child
    finally:
        if child is not None:
            child.kill()
            child.communicate()


def start_compiling(parts: Sequence[Part], niceness: int = 0) -> subprocess.Popen[bytes]:
    """A process that compiles these parts in turn, and prints a character for each kernel."""
    command = [sys.executable, "-m", __name__, str(niceness), *(part.function for part in parts)]
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)


class _Dots(event.Listener):
    def on_start(self, _event: event.Event) -> None:
        """A kernel begins."""

    def on_end(self, _event: event.Event) -> None:
        """A kernel is compiled."""
        os.write(1, b".")


def main() -> None:
    """Compile the parts that the command line names."""
    gc.disable()  # the process lives for seconds
    niceness, *functions = sys.argv[1:]
    if int(niceness) and hasattr(os, "nice"):
        os.nice(int(niceness))
    event.register("numba:compile", _Dots())  # type: ignore[no-untyped-call]
    for function in functions:
        resolve_name(function)()
        mark = Part(function, 0).mark
        if mark is not None:
            mark.parent.mkdir(parents=True, exist_ok=True)
            mark.touch()


if __name__ == "__main__":
    main()
