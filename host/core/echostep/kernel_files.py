# SPDX-License-Identifier: MIT
"""Compiled kernels on disk, each with a check sum: a file that a power failure has cut or filled with zeros is put aside, never run.

In: numba's cache of a kernel. Out: the same, which finds nothing where a file is damaged or cannot be read, so that numba compiles the kernel anew.
Owns the check sum and the names of files put aside. numba has no public option for this: a version of it without these methods checks nothing.
"""

from __future__ import annotations

import os
import pickle
import sys
import zlib
from contextlib import suppress
from functools import cache
from typing import Any

import numba
from numba.core.caching import IndexDataCacheFile

DIGEST = 4  # bytes of the check sum, behind the pickle
ASIDE = ".damaged"
DAMAGED = f"compiled kernels are damaged, as after a power failure: they are put aside (*{ASIDE}) and compiled anew"
UNWRITTEN = "compiled kernels cannot be kept"


_Files: Any = IndexDataCacheFile  # numba has no types for it


class CheckedFiles(_Files):  # type: ignore[misc]
    """numba's index and data files of one kernel."""

    def save(self, key: Any, data: Any) -> None:
        """Write a kernel; where that fails, the run goes on with the one in memory."""
        try:
            super().save(key, data)
        except OSError as error:
            _tell(f"{UNWRITTEN}: {error.strerror or error}: {self._cache_path}")

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
            _put_aside(path)
        return None


def _is_of_another_numba(index: bytes) -> bool:
    """Whether an index begins with a version; damage inside the version is damage."""
    try:
        version = pickle.loads(index)
    except Exception:  # pickle raises whatever the bytes make it raise
        return False
    return isinstance(version, str) and version.isprintable() and version != numba.__version__


def _put_aside(path: str) -> None:
    """Rename a damaged file; where that fails it stays, and is compiled anew at each start."""
    _tell(DAMAGED)
    with suppress(OSError):
        os.replace(path, path + ASIDE)  # noqa: PTH105


def check_files(dispatcher: Any) -> None:
    """Let the cache of a kernel check its files."""
    files = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if type(files) is IndexDataCacheFile:
        files.__class__ = CheckedFiles


@cache
def _tell(sentence: str) -> None:
    """Print a sentence once a run."""
    print(f"echostep: {sentence}", file=sys.stderr)
