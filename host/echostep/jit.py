# SPDX-License-Identifier: MIT
"""How kernels are compiled: the only place that configures numba.

In: functions. Out: the same, compiled when first called and cached in the folder that `kernel_cache` names; the commands are told of each. Owns the
options.

numba counts references to every array that one kernel hands to another, atomically. In kernels that run once per sample or particle that takes longer
than their work: `lean_kernel` counts none, so it returns numbers or tuples of them and makes no arrays. numba has no public option for this.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import config, njit
from numba.core import event
from numba.np import linalg

from echostep.kernel_cache import cache_folder, on_compiling

Function = TypeVar("Function", bound=Callable[..., Any])

_OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy"}  # a division by zero is inf or NaN, as in numpy
_UNCOUNTED: dict[str, Any] = {**_OPTIONS, "_nrt": False}
_COUNTED: dict[str, Any] = {**_OPTIONS, "_nrt": True}


def kernel(function: Function) -> Function:
    """A kernel that may make arrays, but for when a lean kernel calls it: then it is compiled as lean as its caller."""
    return _compiled(function, _OPTIONS)


def lean_kernel(function: Function) -> Function:
    """A kernel that makes no arrays and counts no references to those that it is given."""
    return _compiled(function, _UNCOUNTED)


def allocating_kernel(function: Function) -> Function:
    """A kernel that makes arrays although a lean kernel calls it."""
    return _compiled(function, _COUNTED)


def inline_kernel(function: Function) -> Function:
    """A kernel that is copied into each of its callers and compiled with their options."""
    return _compiled(function, {**_OPTIONS, "inline": "always"})


def _compiled(function: Function, options: dict[str, Any]) -> Function:
    """The function as numba compiles it. numba chooses the cache's folder in here, by `CACHE_DIR`; other users of numba keep theirs."""
    setting = vars(config)  # numba's types do not name its settings
    before = setting["CACHE_DIR"]
    setting["CACHE_DIR"] = str(cache_folder(function.__code__.co_filename) or before)
    try:
        return cast("Function", njit(**options)(function))
    finally:
        setting["CACHE_DIR"] = before


class _Compilations(event.Listener):
    """Reports each kernel that is compiled because no cache has it; those that it calls are compiled within."""

    def __init__(self) -> None:
        self._depth = 0

    def on_start(self, _event: event.Event) -> None:
        """A kernel, or one that it calls."""
        self._depth += 1
        if self._depth == 1 and on_compiling:
            on_compiling[-1]()

    def on_end(self, _event: event.Event) -> None:
        """The end of it, also by an error."""
        self._depth -= 1


event.register("numba:compile", _Compilations())  # type: ignore[no-untyped-call]


def _defer_blas() -> None:
    """Load the part of numba that looks for BLAS through all of scipy (0.15 s), and let it look when a kernel asks for BLAS; none of ours does.

    numba has no public way to say so: without the inner name nothing is deferred.
    """
    look = getattr(linalg, "ensure_blas", None)
    if look is None or "numba.np.arraymath" in sys.modules:
        return
    linalg.ensure_blas = lambda: None
    try:
        from numba.np import arraymath  # noqa: F401
    finally:
        linalg.ensure_blas = look


_defer_blas()
