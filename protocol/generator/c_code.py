# SPDX-License-Identifier: MIT
"""firmware/messages.h and messages.c: structs, packers of the board's messages, unpackers of the host's.

In: the messages between board and host. Out: C11 source. Owns nothing.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator
from itertools import groupby

from generator.schema import FIXED_SEED, LICENCE, NOTICE, Field, Message, crc_seed, enumerations, schema_hash

COMMENT_WIDTH = 120  # as in the hand-written C


def c_header(messages: list[Message]) -> str:
    """firmware/messages.h."""
    lines = _constants(messages)
    lines += ["", *_enumeration(f"MSG_{m.name.upper()} = 0x{m.id:02X}" for m in messages)]
    asked = [m for m in messages if m.direction == "host"]
    lines += _enumeration(f"MSG_{m.name.upper()}_SIZE = {m.size}" for m in asked)
    for name, (members, _) in enumerations(messages).items():
        lines += _enumeration(f"{name.upper()}_{m.upper()} = {value}" for m, value in members.items())
    for message in messages:
        lines += _declaration(message)
    return "\n".join([*lines, "", "#endif"]) + "\n"


def _enumeration(members: Iterable[str]) -> list[str]:
    whole = ", ".join(member.replace(" ", "\0") for member in members)  # no line ends within a member
    lines = textwrap.wrap(f"enum {{ {whole} }};", COMMENT_WIDTH - 3, subsequent_indent="\t")
    return [line.replace("\0", " ") for line in lines]


def _constants(messages: list[Message]) -> list[str]:
    value = schema_hash(messages)
    markers = {name: marker for m in messages for name, marker in m.invalid_markers.items()}
    return [
        f"/* {LICENCE} */",
        f"/* The messages of protocol/README.md. {NOTICE} */",
        "#ifndef ECHOSTEP_MESSAGES_H",
        "#define ECHOSTEP_MESSAGES_H",
        "",
        "#include <stdbool.h>",
        "#include <stdint.h>",
        "",
        f"#define SCHEMA_HASH 0x{value:08X}ul",
        f"#define SCHEMA_SEED 0x{crc_seed(value):04X}u",
        f"#define IDENTITY_SEED 0x{FIXED_SEED:04X}u",
        f"#define MSG_MAX_SIZE {max(m.size for m in messages)}u /* longest body */",
        "",
        "/* What a field holds when nothing was measured. */",
        *(f"#define MSG_{name} (({field.wire.c_name}){invalid})" for name, (field, invalid) in markers.items()),
    ]


def _declaration(message: Message) -> list[str]:
    """Struct and function of one message."""
    if not message.fields:
        return []
    lines = ["", f"struct msg_{message.name} {{", *_members(message.fields), "};"]
    return [*lines, f"{_signature(message)};"]


def _members(fields: Iterable[Field]) -> Iterator[str]:
    """Neighbours of one type, unit and invalid value in one declaration."""
    for (c_name, unit, invalid), alike in groupby(fields, lambda field: (field.wire.c_name, field.unit, field.invalid)):
        notes = ", ".join(n for n in (unit, "" if invalid is None else f"{invalid}: invalid") if n)
        text = f"{c_name} {', '.join(field.name for field in alike)};"
        lines = textwrap.wrap(text, COMMENT_WIDTH - 50, initial_indent="\t", subsequent_indent="\t\t")
        yield "\n".join(lines) + (f" /* {notes} */" if notes else "")


def _signature(message: Message) -> str:
    name = message.name
    if message.direction == "board":
        return f"uint8_t msg_pack_{name}(uint8_t *out, const struct msg_{name} *m)"
    return f"bool msg_unpack_{name}(struct msg_{name} *m, const uint8_t *in, uint8_t length)"


PACK = """
#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error the messages are copied with their least byte first
#endif

/* Copies a struct without what lies between its fields; `sizes`: of each field, then a zero and the bytes of the fields
 * that were added, whose zeros at the end stay away. Returns the bytes. */
static uint8_t pack(uint8_t *out, const void *m, const uint8_t *sizes)
{
	const uint8_t *in = m;
	uint8_t length = 0, at = 0, size;
	while ((size = flash_byte(sizes++)) != 0) {
		uint8_t alignment = size == 4u ? _Alignof(uint32_t) : size == 2u ? _Alignof(uint16_t) : 1u;
		while (at % alignment)
			at++;
		while (size--)
			out[length++] = in[at++];
	}
	for (size = flash_byte(sizes); size && !out[length - 1]; size--)
		length--;
	return length;
}

#define PACKED(message, added, ...) \\
	uint8_t msg_pack_##message(uint8_t *out, const struct msg_##message *m) \\
	{ \\
		static const uint8_t sizes[] FLASH = { __VA_ARGS__, 0, added }; \\
		return pack(out, m, sizes); \\
	}

"""
GET16 = """
static uint16_t get16(const uint8_t *in)
{
	return (uint16_t)(in[0] | (uint16_t)in[1] << 8);
}
"""


def c_code(messages: list[Message]) -> str:
    """firmware/messages.c."""
    reads_16_bits = any(f.size == 2 for m in messages if m.direction == "host" for f in m.fields)
    includes = '#include "messages.h"\n#include "board.h" /* tables in flash */\n'
    text = f"/* {LICENCE} */\n/* {NOTICE} */\n" + includes + (GET16 if reads_16_bits else "") + PACK
    text += "".join(map(_packed, (m for m in messages if m.direction == "board")))
    for message in (m for m in messages if m.fields and m.direction == "host"):
        text += "\n".join(["", _signature(message), "{", *_unpack(message), "}"]) + "\n"
    return text


def _packed(message: Message) -> str:
    sizes = ", ".join(str(size) for size in (message.size - message.least, *(field.size for field in message.fields)))
    return "\n\t".join(textwrap.wrap(f"PACKED({message.name}, {sizes})", COMMENT_WIDTH - 8)) + "\n"


def _unpack(message: Message) -> list[str]:
    size = f"MSG_{message.name.upper()}_SIZE"
    wrong = f"length != {size}" if message.least == message.size else f"length < {message.least} || length > {size}"
    lines = [f"\tif ({wrong})", "\t\treturn false;"]
    for field, offset in zip(message.fields, message.offsets, strict=True):
        if field.added:
            lines.append(f"\tm->{field.name} = length > {offset} ? in[{offset}] : 0;")
        elif field.type == "u8":
            lines.append(f"\tm->{field.name} = in[{offset}];")
        elif field.type == "u16":
            lines.append(f"\tm->{field.name} = get16(in + {offset});")
        else:
            raise ValueError(f"messages.toml: {message.name}.{field.name}: host messages hold u8 and u16 only")
    return [*lines, "\treturn true;"]
