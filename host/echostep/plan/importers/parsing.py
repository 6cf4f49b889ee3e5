# SPDX-License-Identifier: MIT
"""Reads untrusted files within limits.

In: a path. Out: bytes, text, or parsed JSON; every error is an EchostepError that names the file. Owns the limits.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from echostep.errors import EchostepError

FORMATS = "DXF, IFC, IMDF (zip or folder), OpenStreetMap (.osm, .xml, .geojson, JSON of Overpass), ROS (map.yaml), WRLD (main.json), biba (core.txt)"
LARGEST_BYTES = 512 * 2**20


def read_bytes(path: Path) -> bytes:
    """The bytes of a file that is not larger than `LARGEST_BYTES`."""
    try:
        if not path.is_file():
            raise EchostepError(f"{path}: {'not a file' if path.exists() else 'no such file'}")
        if path.stat().st_size > LARGEST_BYTES:
            raise EchostepError(f"{path}: larger than {LARGEST_BYTES // 2**20} MiB: export one building only")
        return path.read_bytes()
    except OSError as error:
        raise EchostepError(f"{path}: cannot be read: {error.strerror or error}") from error


def read_text(path: Path) -> str:
    """The text of a file in UTF-8 (with or without a byte order mark) or UTF-16 (with one)."""
    return decode(read_bytes(path), str(path))


def decode(raw: bytes, name: str) -> str:
    """Decode bytes as UTF-8 or UTF-16; `name`: of the file, for the error."""
    try:
        return raw.decode("utf-16" if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError as error:
        raise EchostepError(f"{name}: not UTF-8 text (byte {error.start}): save it as UTF-8") from error


def parse_json(text: str, name: str) -> Any:
    """Parse JSON; NaN and infinities are errors."""
    try:
        return json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        raise EchostepError(f"{name}: not JSON: {error}") from error


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is not a number")
