# SPDX-License-Identifier: MIT
"""How kernels are compiled: the only place that configures numba.

In: functions. Out: the same, compiled when first called and cached in the folder that `kernel_cache` names; the commands are notified of each. Owns
the options.

A *kernel* is called from Python, a *part* by kernels and other parts; a kernel that a kernel calls is a part there. A part has no wrapper for Python,
a fifth of the work of compiling, and no version for one constant: numba makes these while it takes `k = 0` before a loop for the type of `k`.

numba counts references to every array that one kernel hands to another, atomically. In kernels that run once per sample or particle that takes longer
than their work: a lean kernel counts none, so it returns numbers or tuples of numbers and makes no arrays. numba has no public option for this.

Kernels on disk have a check sum each: a file that a power failure has cut or filled with zeros is put aside, and its kernel compiled again.
"""

from __future__ import annotations

import os
import pickle
import sys
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import cached_property
from typing import Any, TypeVar, cast

import numba
from numba import config, njit, types
from numba.core import event
from numba.core.caching import IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.registry import CPUDispatcher
from numba.extending import models, register_model
from numba.np import linalg

from echostep.kernel_cache import cache_folder, on_compiling, tell

Function = TypeVar("Function", bound=Callable[..., Any])

# A division by zero is inf or NaN, as in numpy. The wrapper left out is the one by which C would call a kernel.
_KERNEL: dict[str, Any] = {"cache": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_LEAN, _COUNTED, _INLINE = {"_nrt": False}, {"_nrt": True}, {"forceinline": True}
DIGEST = 4  # bytes of the check sum, behind the pickle
ASIDE = ".damaged"
DAMAGED = f"compiled kernels are damaged, as after a power failure: they are put aside (*{ASIDE}) and compiled anew"
UNWRITTEN = "compiled kernels cannot be kept"


def kernel(function: Function) -> Function:
    """A kernel that may make arrays, except when a lean kernel calls it: then it is compiled as lean as its caller."""
    return _kernel(function, {})


def lean_kernel(function: Function) -> Function:
    """A kernel that makes no arrays and counts no references to the arrays that it is given."""
    return _kernel(function, _LEAN)


def inline_kernel(function: Function) -> Function:
    """A kernel that the compiler copies into each kernel that calls it."""
    return _kernel(function, _INLINE)


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
        self.py_func, self._options = function, options

    @cached_property
    def dispatcher(self) -> Any:
        """Made when a kernel that calls it is compiled: a kernel from the cache needs none."""
        return _compiled(self.py_func, self._options)

    def __call__(self, *_arguments: object) -> None:
        raise TypeError(f"{self.py_func.__qualname__} is a part of kernels: Python cannot call it")

    _numba_type_ = property(lambda self: _PartType(self.dispatcher))


class _PartLibrary(JITCodeLibrary):
    """The code of a part, for its callers to take: alone it is neither optimised nor made machine code, which is a fifth of the work of compiling.

    numba gives the machine code of each function an environment, through `codegen`: this stands for it and does nothing.
    """

    codegen = property(lambda self: self)

    def _nothing(self, *_: object) -> None: ...

    set_env = _optimize_final_module = _nothing

    def _finalize_final_module(self) -> None:
        self._finalized = True


class _PartCompiler(Compiler):
    def define_pipelines(self) -> Any:
        """The steps of numba's compiler, with such a library."""
        name, codegen = self.state.func_id.func_qualname, self.state.targetctx.codegen()
        self.state.library = _PartLibrary(codegen, name)  # type: ignore[no-untyped-call]
        return super().define_pipelines()  # type: ignore[no-untyped-call]


class _PartType(types.Dispatcher):
    """The type of a part: a constant among its arguments is a number like any other."""

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:
        unliteral: Callable[[Any], Any] = types.unliteral
        numbers = {name: unliteral(kind) for name, kind in kws.items()}
        return super().get_call_type(context, tuple(map(unliteral, args)), numbers)


register_model(_PartType)(models.OpaqueModel)


class _Kernel(CPUDispatcher):
    """A kernel as Python calls it; kernels that call it take its `part`: one version for constants, and nothing that only Python needs."""

    part: _Part
    _numba_type_ = property(lambda self: self.part._numba_type_)


# The kernel that calls it is cached with it
_PART: dict[str, Any] = {**_KERNEL, "no_cpython_wrapper": True, "cache": False, "pipeline_class": _PartCompiler}


def _kernel(function: Function, options: dict[str, Any]) -> Function:
    compiled: Any = _compiled(function, _KERNEL | options)
    compiled.__class__, compiled.part = _Kernel, _Part(function, _PART | options)
    return cast("Function", compiled)


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


_Files: Any = IndexDataCacheFile  # numba has no types for it


class CheckedFiles(_Files):  # type: ignore[misc]
    """numba's index and data files of one kernel."""

    def save(self, key: Any, data: Any) -> None:
        """Write a kernel; where that fails, the run goes on with the one in memory."""
        try:
            super().save(key, data)
        except OSError as error:
            tell(f"{UNWRITTEN}: {error.strerror or error}: {self._cache_path}")

    def _load_index(self) -> dict[Any, str]:
        """The kernel's versions, by their types; empty where the file is absent, of another numba or another source, or damaged."""
        version_bytes = pickle.dumps(self._version, protocol=-1)
        data = self._checked(self._index_path, version_bytes)
        stamp, versions = (None, {}) if data is None else pickle.loads(data)
        return versions if stamp == self._source_stamp else {}

    def _load_data(self, name: str) -> Any:
        data = self._checked(self._data_path(name), b"")
        return None if data is None else pickle.loads(data)

    def _dump(self, obj: Any) -> bytes:
        data: bytes = super()._dump(obj)
        return data + zlib.crc32(data).to_bytes(DIGEST, "big")

    def _checked(self, path: str, begin: bytes) -> bytes | None:
        """The bytes behind `begin`, without their check sum; None if there is no such file, or none any more, for it was damaged."""
        try:
            with open(path, "rb") as file:  # noqa: PTH123 (as numba: 400 times a start)
                content = file.read()
        except FileNotFoundError:
            return None
        except OSError:
            content = b""
        data = content[len(begin) : -DIGEST]
        if data and content.startswith(begin) and zlib.crc32(data).to_bytes(DIGEST, "big") == content[-DIGEST:]:
            return data
        if not (begin and _is_of_another_numba(content)):
            tell(DAMAGED)
            with suppress(OSError):  # then its kernel is compiled again at each start
                os.replace(path, path + ASIDE)  # noqa: PTH105
        return None


def _is_of_another_numba(index: bytes) -> bool:
    """Whether an index begins with a version; damage inside the version is damage."""
    try:
        version = pickle.loads(index)
    except Exception:  # damaged bytes make pickle raise any exception
        return False
    return isinstance(version, str) and version.isprintable() and version != numba.__version__


def check_files(dispatcher: Any) -> None:
    """Let the cache of a kernel check its files."""
    files = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if type(files) is IndexDataCacheFile:
        files.__class__ = CheckedFiles


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
    """Load numba's linear algebra without its search for BLAS, which imports all of scipy (0.15 s), until a kernel needs BLAS; none of ours does.

    numba has no public option for this: without the inner name nothing is deferred.
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
