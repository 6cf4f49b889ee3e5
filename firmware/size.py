#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Flash, static RAM and an upper bound of the stack of the firmware, each against its limit.

Also where the memory lies that survives a reset (.noinit): the bootloader must not write there.
In: the ELF, and the compiler's stack usage files (-fstack-usage) in the same folder. Out: a table; exit status 1 when a
limit is exceeded. The bound comes from the call graph of the disassembly: the deepest chain of calls from main plus the
deepest interrupt (interrupts do not nest). A switch may jump through a table, whose entries must lie in its function; any
other computed jump is an error. Owns nothing.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

FUNCTION = re.compile(r"^([0-9a-f]+) <([A-Za-z_][\w.]*)>:\n", re.MULTILINE)
INSTRUCTION = re.compile(r"^ +([0-9a-f]+):\t((?:[0-9a-f]{2} )+)(.*)$", re.MULTILINE)
CALL = re.compile(r"r?(?:call|jmp) (?:.*; )?0x([0-9a-f]+)")
TARGET = re.compile(r"(?:; |jmp )0x([0-9a-f]+)")
TABLE_JUMP = "__tablejump2__"  # of libgcc: jumps to where the word at word address Z of the flash says
COMPUTED = re.compile(rf" (?:e?icall|e?ijmp)\b|<{TABLE_JUMP}>")
SWITCH = re.compile(  # Z = the word address of a table + an index below its length
    r"^(?P<first>\w+) cpi (?:r30|(?P<index>r\d+)), 0x(?P<length>\w+).*\n(?P<wide>\w+ cpc r\d+, r1\n)?"
    r"(?:\w+ brcc .*|\w+ brcs \.\+[24] .*\n\w+ r?jmp .*)\n"
    r"(?(index)\w+ mov(?(wide)w) r30, (?P=index)\n)(?(wide)|\w+ ldi r31, 0x00.*\n)"
    r"\w+ subi r30, 0x(?P<low>\w+).*\n"
    r"\w+ sbci r31, 0x(?P<high>\w+).*\n"
    rf"(?P<last>\w+) r?jmp .*<{TABLE_JUMP}>$",
    re.MULTILINE,
)
INTERRUPT = re.compile(r"__vector_\d+$")
RETURN_ADDRESS = 2  # bytes on the stack
BOOTLOADER_WRITES = (0x0300, 0x0800)  # Caterina's variables end below the first address, its key is at the second
DATA_SPACE = 0x800000  # of the ELF


def output_of(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def plain(name: str) -> str:
    """Name of a function in its source, without the ending of a part or copy that the compiler has made (`.isra.0`)."""
    return name.partition(".")[0]


def frames(folder: Path) -> dict[str, int]:
    """Function name -> stack bytes, return address included; the largest if several functions or parts have this name."""
    found: dict[str, int] = {}
    for path in folder.rglob("*.su"):
        for line in path.read_text().splitlines():
            location, size, _ = line.split("\t")
            name = plain(location.rsplit(":", 1)[1])
            found[name] = max(found.get(name, 0), int(size))
    return found


def stays_inside(code: dict[int, str], flash: dict[int, int]) -> bool:
    """Whether a function's computed jumps lead back into it: each is a SWITCH whose table holds addresses of its instructions."""
    text = "\n".join(f"{at:x} {instruction}" for at, instruction in code.items())
    rest = SWITCH.sub("", text)
    entered = {int(to, 16) for to in TARGET.findall(rest)}
    for switch in SWITCH.finditer(text):
        first, length, low, high, last = (int(x, 16) for x in switch.group("first", "length", "low", "high", "last"))
        table = 2 * (-(high << 8 | low) & 0xFFFF)
        entries = range(table, table + 2 * length, 2)
        targets = {2 * (flash.get(at, 0) | flash.get(at + 1, 0) << 8) for at in entries}
        if not targets <= code.keys() or any(first < at <= last for at in entered):
            return False
    return not COMPUTED.search(rest)


def call_graph(listing: str) -> tuple[dict[int, str], dict[int, set[int]], dict[int, int]]:
    """From a disassembly, per function address: its name, the addresses that it calls or jumps to, the bytes that it pushes."""
    names: dict[int, str] = {}
    calls: dict[int, set[int]] = {}
    pushed: dict[int, int] = {}
    lines = INSTRUCTION.findall(listing)
    flash = {int(at, 16) + k: byte for at, raw, _ in lines for k, byte in enumerate(bytes.fromhex(raw))}
    parts = FUNCTION.split(listing)[1:]
    for address, name, body in zip(parts[::3], parts[1::3], parts[2::3], strict=True):
        code = {int(at, 16): " ".join(text.split()) for at, _, text in INSTRUCTION.findall(body)}
        if name != TABLE_JUMP and not stays_inside(code, flash):
            raise SystemExit(f"{name} jumps to a computed address: its stack cannot be bounded")
        here = int(address, 16)
        names[here] = plain(name)
        calls[here] = {int(match[1], 16) for match in map(CALL.match, code.values()) if match}
        pushed[here] = sum(instruction.startswith("push ") for instruction in code.values())
    return names, calls, pushed


def deepest(elf: Path) -> int:
    """Stack bytes of the deepest chain of calls from main plus the deepest interrupt; a recursion is an error."""
    names, calls, pushed = call_graph(output_of("avr-objdump", "-d", str(elf)))
    known = frames(elf.parent)

    def depth(address: int, callers: tuple[int, ...]) -> int:
        if address in callers:
            raise SystemExit(f"{elf}: {names[address]} calls itself: its stack cannot be bounded")
        own = known.get(names[address], RETURN_ADDRESS + pushed[address])
        inner = (depth(to, (*callers, address)) for to in calls[address] if to in names and to != address)
        return own + max(inner, default=0)

    main = next(address for address, name in names.items() if name == "main")
    interrupts = (depth(address, ()) for address, name in names.items() if INTERRUPT.match(name))
    return depth(main, ()) + max(interrupts, default=0)


def kept_memory(elf: Path) -> tuple[int, int]:
    """First address of .noinit, and the address behind it."""
    fields = next(f for f in map(str.split, output_of("avr-size", "-A", str(elf)).splitlines()) if f[:1] == [".noinit"])
    begin = int(fields[2]) - DATA_SPACE
    return begin, begin + int(fields[1])


def main() -> int:
    elf = Path(sys.argv[1])
    flash_max, ram_max, memory_max = map(int, sys.argv[2:5])
    text, initialised, zeroed = map(int, output_of("avr-size", str(elf)).splitlines()[1].split()[:3])
    flash, ram, stack = text + initialised, initialised + zeroed, deepest(elf)
    passed = True
    for what, value, limit in (
        ("flash", flash, flash_max),
        ("static RAM", ram, ram_max),
        ("static RAM + stack", ram + stack, memory_max),
    ):
        passed &= value <= limit
        print(f"{what:20}{value:7} B  limit {limit:6} B  {'ok' if value <= limit else 'TOO MUCH'}")
    begin, end = kept_memory(elf)
    safe = BOOTLOADER_WRITES[0] <= begin and end <= BOOTLOADER_WRITES[1]
    low, high = BOOTLOADER_WRITES
    print(
        f"{'kept over a reset':20} 0x{begin:04X}-0x{end - 1:04X}  within 0x{low:04X}-0x{high - 1:04X}  {'ok' if safe else 'OVERWRITTEN'}"
    )
    return 0 if passed and safe else 1


if __name__ == "__main__":
    sys.exit(main())
