# SPDX-License-Identifier: MIT
"""Fields of a message from outside: kinds of numbers and texts; checked against a structure, with one sentence about a wrong one.

In: parsed JSON or TOML, which may be hostile, and a msgspec struct or a dataclass. Out: the structure, or a ValueError that begins with the path of
the wrong field, such as `levels[0].doors[2].line`. Owns nothing: a type's `Meta(description=...)` describes its values.
"""

from __future__ import annotations

import re
import reprlib
from typing import Annotated, Any, TypeVar

import msgspec
from msgspec import Meta, inspect

# names of types without a description
KINDS = {
    "float": "a finite number", "int": "a whole number", "bool": "true or false", "str": "a text", "array": "a list", "object": "an object",
}  # fmt: skip
T = TypeVar("T")

LIMIT_M = 1e5  # greatest coordinate: 100 km, more than any site
Metres = Annotated[float, Meta(ge=-LIMIT_M, le=LIMIT_M, description=f"a finite number within {LIMIT_M:.0f} m")]
Deviation = Annotated[float, Meta(ge=0.0, le=LIMIT_M, description=f"a finite number from 0 to {LIMIT_M:.0f} m")]
Longitude = Annotated[float, Meta(ge=-180.0, le=180.0, description="a finite number within 180 degrees east")]
Latitude = Annotated[float, Meta(ge=-90.0, le=90.0, description="a finite number within 90 degrees north")]
# Characters that UTF-8 and XML cannot hold: lone surrogates, and control characters but tab and line ends [XML 1.0, 2.2]
UNWRITABLE = r"\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff"
Text = Annotated[str, Meta(pattern=rf"^[^{UNWRITABLE}]*$", description="a text without control characters")]


def checked(tree: Any, kind: type[T]) -> T:
    """The tree as a structure of this kind; raises ValueError that names the wrong field, or has the text of the structure's own check."""
    try:
        return msgspec.convert(tree, kind)
    except msgspec.ValidationError as error:
        raise ValueError(error.__cause__ or _sentence(error, tree, inspect.type_info(kind))) from error
    except UnicodeEncodeError as error:  # of a lone surrogate, where no text is expected
        raise ValueError(f"{short(error.object)} is not a text that can be written as UTF-8") from error


def field_of(error: msgspec.ValidationError) -> tuple[str, bool]:
    """The path of the field that an error is about, empty for the message itself, and whether the field is missing. Without the sender's text."""
    words, _, path = str(error).rpartition(" - at `$")
    words, path = (words, path.strip("`.")) if words else (path, "")
    missing = re.match(r"Object missing required field `(\w+)`", words)
    return (f"{path}.{missing[1]}".strip("."), True) if missing else (path, False)


def short(value: Any) -> str:
    """The value as shown in an error: a few dozen characters in one line."""
    if isinstance(value, int) and value.bit_length() > 1000:
        return "a huge number"
    return reprlib.repr(value)


def _sentence(error: msgspec.ValidationError, tree: Any, root: inspect.Type) -> str:
    path, is_missing = field_of(error)
    kind, description = _described(root)
    for step in re.findall(r"\w+", path):
        kind, description = _described(_inner(kind, step))
        tree = tree.get(step) if isinstance(tree, dict) else tree[int(step)]
    expected = re.match(r"Expected `(\w+)", str(error))
    where = path or "the file"
    if is_missing:
        return f"{where}: missing" + (f", expected {description}" if description else "")
    return f"{where}: {short(tree)} is not {description or KINDS.get(expected[1] if expected else '', 'allowed')}"


def _described(kind: inspect.Type) -> tuple[Any, str]:
    """A type (the first of a union) and its description of its values, empty if missing."""
    kind = kind.types[0] if isinstance(kind, inspect.UnionType) else kind
    if not isinstance(kind, inspect.Metadata):
        return kind, ""
    return kind.type, (kind.extra_json_schema or {}).get("description", "")


def _inner(kind: Any, step: str) -> inspect.Type:
    """The type of a field of a structure, or of an element of a list."""
    if isinstance(kind, inspect.StructType | inspect.DataclassType):
        return next(field.type for field in kind.fields if field.encode_name == step)
    inner: inspect.Type = kind.item_types[int(step)] if isinstance(kind, inspect.TupleType) else kind.item_type
    return inner
