# SPDX-License-Identifier: MIT
"""protocol/README.md: one byte table per message, between the page's two marks.

In: the messages, and the page as it is. Out: the page with fresh tables. Owns the words for sender and "not measured".
"""

from __future__ import annotations

import binascii

from generator.schema import FIXED_SEED, Field, Message, crc_seed, schema_hash

BEGIN, END = "<!-- tables -->\n", "<!-- end of tables -->\n"
CHECKED = b"123456789"  # as in catalogues of CRCs
SENDERS = {"board": "board to host", "host": "host to board", "gateway": "beacon gateway to host"}


def readme(messages: list[Message], page: str) -> str:
    """The page with its tables replaced; the text around them stays."""
    head, _, rest = page.partition(BEGIN)
    _, _, tail = rest.partition(END)
    return f"{head}{BEGIN}{_tables(messages)}{END}{tail}"


def _tables(messages: list[Message]) -> str:
    value = schema_hash(messages)
    lines = [f"Schema hash `0x{value:08X}`, CRC seed `0x{crc_seed(value):04X}`.", ""]
    checks = [f"`0x{binascii.crc_hqx(CHECKED, seed):04X}`" for seed in (crc_seed(value), FIXED_SEED)]
    lines += [
        f"CRC of the nine bytes `{CHECKED.decode()}`: {checks[0]} with this seed, {checks[1]} with the fixed one.",
        "",
    ]
    for message in messages:
        lines += _table(message)
    return "\n".join(lines).rstrip() + "\n"


def _table(message: Message) -> list[str]:
    size = f"{message.least} to {message.size}" if message.least < message.size else message.size
    title = f"### `0x{message.id:02X}` {message.name} ({SENDERS[message.direction]}, body {size} B)"
    lines = [title, "", message.doc, ""]
    if not message.fields:
        return lines
    lines += ["| offset | field | type | unit | meaning |", "|---|---|---|---|---|"]
    for field, offset in zip(message.fields, message.offsets, strict=True):
        lines.append(f"| {offset} | `{field.name}` | {field.type} | {field.unit or '-'} | {_meaning(field)} |")
    return [*lines, ""]


def _meaning(field: Field) -> str:
    if (text := field.doc) == "as above":  # its values too
        return text
    for kind, names in (("", field.enum), ("bits: ", field.flags)):
        if names:
            text += f"; {kind}" + ", ".join(f"{k} = {name}" for k, name in enumerate(names))
    return text if field.invalid is None else f"{text}; {field.invalid} = not measured"
