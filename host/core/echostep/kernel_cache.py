# SPDX-License-Identifier: MIT
"""Where compiled kernels are kept: a folder for each state of the sources that they are made from.

In: the file of a module of this package, or of another package whose kernels call those of this one. Out: a folder for numba's cache. Owns the
folders and their names.

numba compares the kernel's own file only. After an update in place it would run a kernel although a callee in another file has changed, and it fails
on a NamedTuple that has been renamed, for it unpickles the whole index before it compares. So the name of the folder holds a digest of the module and
of all modules of both packages that it imports, directly or not: every other state has another folder, and is never read.
"""

from __future__ import annotations

import hashlib
import os
import re
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path

from echostep.errors import EchostepError

PACKAGE = str(Path(__file__).parent)
IMPORT = re.compile(rb"^ *(?:from ([\w.]+) import (\([^)]*\)|.*)|import ([\w.]+))", re.MULTILINE)
WORD = re.compile(rb"\w+")
DIGITS = 16  # of the digest, hexadecimal
on_compiling: list[Callable[[], None]] = []  # the newest is called before a kernel is compiled; the commands show it
_roots = {__package__: PACKAGE}  # name -> folder of the packages whose imports are followed


@cache
def cache_folder(source: str) -> Path | None:
    """The folder of the kernels of a module, by its file; files of its other states are deleted. None if the file is not part of a package."""
    path = Path(source)
    root = _root_of(path.parent)
    if root is None or not path.is_file():
        return None
    _roots.setdefault(root.name, str(root))
    module = path.stem
    folder = _folder(path.parent, root, f"{module}-{_digest(source)}")
    if not folder.is_dir():
        for old in folder.parent.glob(f"{module}-*/*/*.nb[ic]"):
            old.unlink(missing_ok=True)  # their folders stay: another process may be about to write there
    return folder


@cache
def _root_of(folder: Path) -> Path | None:
    """The outermost package that holds a folder; None if the folder is not a package."""
    if not (folder / "__init__.py").is_file():
        return None
    return _root_of(folder.parent) or folder


def _folder(package: Path, root: Path, name: str) -> Path:
    """In NUMBA_CACHE_DIR, `__pycache__` beside the sources, or a folder at home: the first that this user can write; else in a temporary one."""
    inside = package.relative_to(root.parent)
    folder = next((base / name for base in _bases(package, inside) if _can_be_written(base / name)), None)
    folder = folder or _temporary_folder() / inside / name
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen and not folder.is_relative_to(chosen):
        used = root if folder.is_relative_to(root) else folder.parents[len(inside.parts)]
        tell(f"NUMBA_CACHE_DIR: {chosen} cannot be written: compiled kernels are kept in {used}")
    return folder


def _bases(package: Path, inside: Path) -> Iterator[Path]:
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        yield Path(chosen) / inside
    yield package / "__pycache__"
    if users := _users_folder():
        yield users / inside


def _can_be_written(folder: Path) -> bool:
    """Whether the user can make files in a folder, which need not exist yet."""
    while not os.path.exists(folder):  # noqa: PTH110 (Path.exists raises in a folder that may not be searched)
        folder = folder.parent
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)


@cache
def tell(sentence: str) -> None:
    """Print a sentence once a run."""
    print(f"echostep: {sentence}", file=sys.stderr)


@cache
def _users_folder() -> Path | None:
    """XDG_CACHE_HOME or ~/.cache; None without a home, or if that folder cannot be written."""
    try:
        folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # RuntimeError: the user has no home
        return None
    return folder if os.access(folder, os.W_OK) else None


@cache
def _temporary_folder() -> Path:
    """A folder for this user alone, kept between runs if nobody else can have made it; its creation is reported.

    numba runs what it finds in its cache, so a folder that another user may write is not used.
    """
    owner = os.getuid() if hasattr(os, "getuid") else "user"
    try:
        folder = Path(tempfile.gettempdir()) / f"echostep-kernels-{owner}"
    except FileNotFoundError as error:
        raise EchostepError("no folder for compiled kernels can be written: give one in NUMBA_CACHE_DIR") from error
    with suppress(FileExistsError):
        folder.mkdir(mode=0o700)
        tell(f"the user has no cache folder that can be written: compiled kernels are kept in {folder}")
    state = folder.lstat()
    if not hasattr(os, "getuid"):  # Windows: the temporary folder is the user's own
        return folder
    if stat.S_ISDIR(state.st_mode) and state.st_uid == owner and not state.st_mode & 0o022:
        return folder
    made = Path(tempfile.mkdtemp(prefix="echostep-kernels-"))
    tell(f"kernels are compiled for this run alone, in {made}: give a folder in NUMBA_CACHE_DIR")
    return made


def _digest(source: str) -> str:
    """A digest of the file and of all files of the known packages that it imports, directly or not."""
    sources, waiting = {source}, [source]
    while waiting:
        new = _read(waiting.pop())[1] - sources
        sources |= new
        waiting += new
    states = hashlib.sha256()
    for name, path in sorted((_name_of(path), path) for path in sources):
        states.update(b"%b %b\n" % (os.fsencode(name), _read(path)[0]))
    return states.hexdigest()[:DIGITS]


def _name_of(source: str) -> str:
    """The file's path from its package's folder on, wherever the package is installed."""
    return next(source[len(root) - len(name) :] for name, root in _roots.items() if source.startswith(root + os.sep))


@cache
def _read(source: str) -> tuple[bytes, frozenset[str]]:
    """Digest of one file, and the files of the known packages that it imports."""
    text = Path(source).read_bytes()
    imported = set[str]()
    for parent, names, alone in IMPORT.findall(text):
        module = (parent or alone).decode()
        if module.partition(".")[0] not in _roots:
            continue
        imported |= _files_of(module)
        for word in WORD.findall(names):
            imported |= _files_of(f"{module}.{word.decode()}")
    return hashlib.sha256(text).digest(), frozenset(imported)


@cache
def _files_of(name: str) -> frozenset[str]:
    """The file of a module or a package, by its full name; none for a name in a module."""
    root, _, inside = name.partition(".")
    path = os.path.join(_roots[root], inside.replace(".", os.sep)).rstrip(os.sep)  # noqa: PTH118 (300 times a start)
    return frozenset(file for file in (f"{path}.py", f"{path}{os.sep}__init__.py") if os.path.isfile(file))  # noqa: PTH113
