# SPDX-License-Identifier: MIT
"""host/core/echostep/board/messages.py: one named tuple per message, its codec, and the bodies as numpy dtypes.

In: the messages. Out: Python source, formatted as ruff does it. Owns nothing.
"""

from __future__ import annotations

from generator.schema import FIXED_SEED, LICENCE, NOTICE, Field, Message, crc_seed, enumerations, schema_hash

LINE = 120  # characters, as ruff is told


def python_code(messages: list[Message]) -> str:
    """The whole module."""
    lines = _head(schema_hash(messages)) + _enumerations(messages)
    for message in messages:
        lines += _message(message)
    tables = _by_id(messages) + _rows(messages) + _least(messages) + _greatest(messages)
    return "\n".join(lines + _union(messages) + tables) + "\n"


def _head(value: int) -> list[str]:
    return [
        f"# {LICENCE}",
        f'"""Messages of the board link. {NOTICE}',
        "",
        "In: the body of a frame. Out: named tuples of raw integers; units stand beside each field. `..._INVALID` is what a field holds",
        "when nothing was measured. `ROWS` are the same bodies as numpy dtypes, for many at once. Owns nothing.",
        '"""',
        "",
        "from __future__ import annotations",
        "",
        "import struct",
        "from enum import IntEnum, IntFlag",
        "from typing import NamedTuple",
        "",
        "import numpy as np",
        "",
        f"SCHEMA_HASH = 0x{value:08X}",
        f"SCHEMA_SEED = 0x{crc_seed(value):04X}",
        f"FIXED_SEED = 0x{FIXED_SEED:04X}",
        "",
        "",
        "def _trimmed(body: bytes, least: int) -> bytes:",
        '    """A body without the zeros at the end of the fields that were added."""',
        '    return body[:least] + body[least:].rstrip(b"\\0")',
        "",
    ]


def _camel(name: str) -> str:
    return "".join(part.capitalize() for part in name.split("_"))


def _enumerations(messages: list[Message]) -> list[str]:
    lines = []
    for name, (members, is_flags) in enumerations(messages).items():
        lines += ["", f"class {_camel(name)}({'IntFlag' if is_flags else 'IntEnum'}):"]
        lines += [f"    {member.upper()} = {value}" for member, value in members.items()] + [""]
    return lines


def _message(message: Message) -> list[str]:
    """Codec, invalid markers and named tuple of one message."""
    codec = f"_{message.name.upper()}"
    lines = ["", f'{codec} = struct.Struct("{message.format}")']
    lines += [f"{name} = {value}" for name, (_, value) in message.invalid_markers.items()]
    lines += ["", "", f"class {_camel(message.name)}(NamedTuple):"]
    lines += [f'    """{_first_sentence(message.doc)}"""', ""]
    lines += [_declaration(field) for field in message.fields]
    lines += [""] if message.fields else []
    return lines + _methods(message, codec)


def _declaration(field: Field) -> str:
    notes = [n for n in (field.unit, "" if field.invalid is None else f"{field.invalid} = invalid") if n]
    default = " = 0" if field.added else ""
    return f"    {field.name}: int{default}" + (f"  # {', '.join(notes)}" if notes else "")


def _methods(message: Message, codec: str) -> list[str]:
    packed, size, wrong = f"{codec}.pack(*self)", str(message.size), f"len(body) != {message.size}"
    if message.least < message.size:
        packed, wrong = f"_trimmed({packed}, {message.least})", f"not {message.least} <= len(body) <= {message.size}"
        size = f"{message.least} to {message.size}"
    return [
        "    @property",
        "    def id(self) -> int:",
        f"        return 0x{message.id:02X}",
        "",
        "    def pack(self) -> bytes:",
        '        """Bytes of the body; raises struct.error when a value does not fit its type."""',
        f"        return {packed}",
        "",
        "    @classmethod",
        f"    def unpack(cls, body: bytes) -> {_camel(message.name)}:",
        '        """Values of a body; raises ValueError when length or an enumeration is wrong."""',
        f"        if {wrong}:",
        f'            raise ValueError(f"{message.name}: {{len(body)}} bytes, expected {size}")',
        *_unpack_values(message, codec),
        "",
    ]


def _unpack_values(message: Message, codec: str) -> list[str]:
    enums = [f for f in message.fields if f.enum]
    body = "body" if message.least == message.size else f'body.ljust({message.size}, b"\\0")'
    if not enums:
        return [f"        return cls._make({codec}.unpack({body}))"]
    lines = [f"        message = cls._make({codec}.unpack({body}))"]
    for f in enums:
        lines += [
            f"        if message.{f.name} >= {len(f.enum)}:",
            f'            raise ValueError(f"{message.name}: {f.name} {{message.{f.name}}} is unknown")',
        ]
    return [*lines, "        return message"]


def _union(messages: list[Message]) -> list[str]:
    first, *others = [_camel(m.name) for m in messages]
    return ["", "Message = (", f"    {first}", *(f"    | {name}" for name in others), ")"]


def _by_id(messages: list[Message]) -> list[str]:
    entries = [f"    0x{m.id:02X}: {_camel(m.name)}," for m in messages]
    return ["", "BY_ID: dict[int, type[Message]] = {", *entries, "}"]


def _rows(messages: list[Message]) -> list[str]:
    """The bodies as numpy dtypes."""
    lines = ["", "ROWS: dict[int, np.dtype[np.void]] = {"]
    for m in messages:
        columns = [f'("{f.name}", "{f.wire.numpy_name}")' for f in m.fields]
        row = f"    0x{m.id:02X}: np.dtype([{', '.join(columns)}]),"
        if len(row) <= LINE:
            lines.append(row)
        else:
            lines += [f"    0x{m.id:02X}: np.dtype(", "        ["]
            lines += [f"            {column}," for column in columns]
            lines += ["        ]", "    ),"]
    return [*lines, "}"]


def _least(messages: list[Message]) -> list[str]:
    """Sizes of the shortest bodies, where they are not those of `ROWS`."""
    shorter = [f"    0x{m.id:02X}: {m.least}," for m in messages if m.least < m.size]
    return ["LEAST = {  # id: bytes of a body without the fields that were added", *shorter, "}"]


def _greatest(messages: list[Message]) -> list[str]:
    """Greatest value of each enumeration, with its place in the body."""
    lines = ["GREATEST = (  # id, offset in the body, greatest value of the enumeration there"]
    for m in messages:
        for f, offset in zip(m.fields, m.offsets, strict=True):
            if f.enum:
                lines.append(f"    (0x{m.id:02X}, {offset}, {len(f.enum) - 1}),  # {m.name}.{f.name}")
    return [*lines, ")"]


def _first_sentence(doc: str) -> str:
    return doc.split(". ", maxsplit=1)[0].rstrip(".") + "."
