# SPDX-License-Identifier: MIT
"""A folder or a zip file with some JSON files, read within limits.

In: a path. Out: texts by file name. Owns the limits; they hold for the unpacked bytes, whatever sizes the zip file states.
"""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path

from echostep.errors import EchostepError
from echostep_app.plan.importers.parsing import decode, read_text

LARGEST_BYTES = 256 * 2**20
# Ratio of unpacked to packed size, beyond the first MiB: GeoJSON packs 5 to 30 times
MOST_RATIO, FREE_BYTES = (100, 2**20)
MOST_FILES = 1000


class Archive:
    """Files by the last part of their path. Use it in a with statement."""

    def __init__(self, path: Path) -> None:
        """Open `path`; raises EchostepError when it is neither a folder nor a zip file."""
        self.path = path
        self._zip: zipfile.ZipFile | None = None
        self._names: dict[str, str] = {}
        if path.is_dir():
            return
        try:
            self._zip = zipfile.ZipFile(path)
            names = self._zip.namelist()
        except (OSError, zipfile.BadZipFile, ValueError, NotImplementedError) as error:
            raise EchostepError(f"{path}: not a zip file: {error}") from error
        if len(names) > MOST_FILES:
            self._zip.close()
            raise EchostepError(f"{path}: the zip file has {len(names)} files; expected {MOST_FILES} at most")
        self._names = {name.rsplit("/", 1)[-1]: name for name in names if "__MACOSX" not in name}

    def __enter__(self) -> Archive:
        """Itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the zip file."""
        if self._zip is not None:
            self._zip.close()

    def label(self, name: str) -> str:
        """The name of a file in error messages: archive and member."""
        return f"{self.path}: {name}"

    def has(self, name: str) -> bool:
        """Whether the archive contains the file."""
        return name in self._names if self._zip is not None else (self.path / name).is_file()

    def ending_with(self, suffix: str) -> list[str]:
        """The names of the zip file's files with this ending, whatever its case."""
        return sorted(name for name in self._names if name.casefold().endswith(suffix))

    def text(self, name: str) -> str:
        """The text of a file."""
        return read_text(self.path / name) if self._zip is None else decode(self.content(name), self.label(name))

    def content(self, name: str) -> bytes:
        """The bytes of a file in the zip file."""
        assert self._zip is not None
        if name not in self._names:
            raise EchostepError(f"{self.label(name)}: the archive has no such file: export it again")
        try:
            with self._zip.open(self._names[name]) as file:
                packed = self._zip.getinfo(self._names[name]).compress_size
                most = min(LARGEST_BYTES, MOST_RATIO * packed + FREE_BYTES)
                raw = file.read(most + 1)
        except (OSError, zipfile.BadZipFile, zlib.error, RuntimeError, NotImplementedError, EOFError) as error:
            raise EchostepError(f"{self.label(name)}: cannot be read: {error}") from error
        if len(raw) > most:
            raise EchostepError(
                f"{self.label(name)}: unpacks to more than {most // 2**20} MiB: too large, or not an exported building"
            )
        return raw
