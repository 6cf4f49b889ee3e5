# SPDX-License-Identifier: MIT
"""Reads untrusted files within limits, and checks values in their JSON.

In: a path. Out: bytes, text, or parsed JSON; every error is an EchostepError that names the file. In: a value and its path in the file, as
`features[3].geometry`. Out: the value with its type, or a ValueError that begins with the path. Owns the limits.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from echostep.errors import EchostepError
from echostep.fields import short
from echostep_app.printing.lines import as_error

PROJECTED = "are these metres of a projected system? save it as EPSG:4326 (longitude, latitude)"
GML = "IndoorGML or CityGML is not read: export the building as IFC, IMDF or DXF"
FORMATS = "DXF, IFC, IMDF (zip or folder), OpenStreetMap (.osm, .xml, .geojson, JSON of Overpass), ROS (map.yaml)"
LARGEST_BYTES = 512 * 2**20


def read_bytes(path: Path) -> bytes:
    """The bytes of a file that is not larger than `LARGEST_BYTES`."""
    with as_error(f"{path}: cannot be read"):
        if not path.is_file():
            raise EchostepError(f"{path}: {'not a file' if path.exists() else 'no such file'}")
        if path.stat().st_size > LARGEST_BYTES:
            raise EchostepError(f"{path}: larger than {LARGEST_BYTES // 2**20} MiB: export one building only")
        return path.read_bytes()


def read_text(path: Path) -> str:
    """The text of a file in UTF-8 (with or without a byte order mark) or UTF-16 (with one)."""
    return decode(read_bytes(path), str(path))


def decode(raw: bytes, name: str) -> str:
    """Decode bytes as UTF-8 or UTF-16; `name`: the file's name for the error."""
    try:
        return raw.decode("utf-16" if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError as error:
        raise EchostepError(f"{name}: not UTF-8 text (byte {error.start}): save it as UTF-8") from error


def parse_json(raw: str, name: str) -> Any:
    """Parse JSON; NaN and infinities are errors."""
    try:
        return json.loads(raw, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        raise EchostepError(f"{name}: not JSON: {error}") from error


def number(value: Any, where: str, limit: float, unit: str) -> float:
    """A finite number within +-limit."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= limit:
        is_number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        grid = f": {PROJECTED}" if unit == "degrees" and is_number else ""
        raise ValueError(f"{where}: {short(value)} is not a finite number within {limit:.0f} {unit}{grid}")
    return float(value)


def finite(text: str, where: str) -> float:
    """A text as a finite number; raises EchostepError."""
    try:
        value = float(text)
    except ValueError as error:
        raise EchostepError(f"{where}: {text[:40]!r} is not a number") from error
    if not math.isfinite(value):
        raise EchostepError(f"{where}: {text[:40]!r} is not finite")
    return value


def text(value: Any, where: str) -> str:
    """A string that can be written as UTF-8."""
    if not isinstance(value, str) or any("\ud800" <= letter <= "\udfff" for letter in value):
        raise ValueError(f"{where}: {short(value)} is not a text")
    return value


def typed(value: Any, where: str, kind: type) -> Any:
    """A value of type `kind`: list, or dict (an object)."""
    if not isinstance(value, kind):
        raise ValueError(f"{where}: expected {'a list' if kind is list else 'an object'}, found {type(value).__name__}")
    return value


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is not a number")
