# SPDX-License-Identifier: MIT
"""How kernels are compiled: the only place that configures numba.

In: functions. Out: the same, compiled when first called and cached in the folder that `kernel_cache` names; the commands are told of each. Owns the
options.

A *kernel* is called from Python; a *part* is called by kernels and other parts alone. A part has no wrapper for Python, which is a fifth of the work
of compiling, and none of its versions is made for one constant: numba makes them while it still takes `k = 0` before a loop for the type of `k`.

numba counts references to every array that one kernel hands to another, atomically. In kernels that run once per sample or particle that takes longer
than their work: a lean kernel counts none, so it returns numbers or tuples of numbers and makes no arrays. numba has no public option for this.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import config, njit, types
from numba.core import event
from numba.extending import models, register_model, typeof_impl
from numba.np import linalg

from echostep.kernel_cache import cache_folder, on_compiling
from echostep.kernel_files import check_files

Function = TypeVar("Function", bound=Callable[..., Any])

# A division by zero is inf or NaN, as in numpy. The wrapper left out is the one by which C would call a kernel.
_KERNEL: dict[str, Any] = {"cache": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_PART: dict[str, Any] = {
    **_KERNEL,
    "no_cpython_wrapper": True,
    "cache": False,
}  # the kernel that calls it is cached with it
_LEAN, _COUNTED, _INLINE = {"_nrt": False}, {"_nrt": True}, {"forceinline": True}


def kernel(function: Function) -> Function:
    """A kernel that may make arrays, except when a lean kernel calls it: then it is compiled as lean as its caller."""
    return _compiled(function, _KERNEL)


def lean_kernel(function: Function) -> Function:
    """A kernel that makes no arrays and counts no references to the arrays that it is given."""
    return _compiled(function, _KERNEL | _LEAN)


def inline_kernel(function: Function) -> Function:
    """A kernel that the compiler copies into each kernel that calls it."""
    return _compiled(function, _KERNEL | _INLINE)


def part(function: Function) -> Function:
    """A part that may make arrays, except when its caller is lean."""
    return _part(function, _PART)


def lean_part(function: Function) -> Function:
    """A part that makes no arrays and counts no references."""
    return _part(function, _PART | _LEAN)


def allocating_part(function: Function) -> Function:
    """A part that makes arrays although its caller is lean."""
    return _part(function, _PART | _COUNTED)


def inline_part(function: Function) -> Function:
    """A part that the compiler copies into each of its callers."""
    return _part(function, _PART | _INLINE)


class _Part:
    """The object that numba compiles from a part. Called from Python, where it would crash without a wrapper, it raises TypeError."""

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        self.py_func = function
        self.dispatcher: Any = _compiled(function, options)

    def __call__(self, *_arguments: object) -> None:
        raise TypeError(f"{self.py_func.__qualname__} is a part of kernels: Python cannot call it")


class _PartType(types.Dispatcher):
    """The type of a part: a constant among its arguments is a number like any other."""

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:
        unliteral: Callable[[Any], Any] = types.unliteral
        numbers = {name: unliteral(kind) for name, kind in kws.items()}
        return super().get_call_type(context, tuple(map(unliteral, args)), numbers)


register_model(_PartType)(models.OpaqueModel)


@typeof_impl.register(_Part)
def _type_of_part(value: _Part, _context: object) -> _PartType:
    return _PartType(value.dispatcher)


def _part(function: Function, options: dict[str, Any]) -> Function:
    return cast("Function", _Part(function, options))


def _compiled(function: Function, options: dict[str, Any]) -> Function:
    """The function as numba compiles it. numba chooses the cache's folder in here, by `CACHE_DIR`; other users of numba keep theirs."""
    setting = vars(config)  # numba's types do not name its settings
    before = setting["CACHE_DIR"]
    setting["CACHE_DIR"] = str(cache_folder(function.__code__.co_filename) or before)
    try:
        compiled = njit(**options)(function)
    finally:
        setting["CACHE_DIR"] = before
    check_files(compiled)
    return cast("Function", compiled)


class _Compilations(event.Listener):
    """Reports each kernel that is compiled because no cache has it; kernels that it calls are compiled within."""

    def __init__(self) -> None:
        self._depth = 0

    def on_start(self, _event: event.Event) -> None:
        """Compilation of a kernel begins, or of one that it calls."""
        self._depth += 1
        if self._depth == 1 and on_compiling:
            on_compiling[-1]()

    def on_end(self, _event: event.Event) -> None:
        """Compilation ends, also by an error."""
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
