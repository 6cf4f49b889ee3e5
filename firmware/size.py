#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Flash, static RAM and an upper bound of the stack of the firmware, each against its limit.

Also where the memory lies that survives a reset (.noinit): the bootloader must not write there.
In: the ELF, and the compiler's stack usage files (-fstack-usage) in the same folder. Out: a table; exit status 1 when a
limit is exceeded. The bound comes from the call graph of the disassembly: the deepest chain of calls from main plus the
deepest interrupt (interrupts do not nest). Owns nothing.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

FUNCTION = re.compile(r"^([0-9a-f]+) <(\w+)>:$")
CALL = re.compile(r"\s(?:r?call|r?jmp)\s.*;\s*0x([0-9a-f]+)")
ABSOLUTE_CALL = re.compile(r"\s(?:call|jmp)\s+0x([0-9a-f]+)")
INDIRECT = re.compile(r"\s(?:icall|eicall|ijmp|eijmp)\b")
INTERRUPT = re.compile(r"__vector_\d+$")
RETURN_ADDRESS = 2  # bytes on the stack
BOOTLOADER_WRITES = (0x0300, 0x0800)  # Caterina's variables end below the first address, its key is at the second
DATA_SPACE = 0x800000  # of the ELF


def output_of(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def frames(folder: Path) -> dict[str, int]:
    """Function name -> stack bytes, return address included; the largest if several functions have this name."""
    found: dict[str, int] = {}
    for path in folder.rglob("*.su"):
        for line in path.read_text().splitlines():
            location, size, _ = line.split("\t")
            name = location.rsplit(":", 1)[1]
            found[name] = max(found.get(name, 0), int(size))
    return found


def call_graph(elf: Path) -> tuple[dict[int, str], dict[int, set[int]], dict[int, int]]:
    """Per function address: its name, the addresses that it calls or jumps to, and the bytes that it pushes."""
    names: dict[int, str] = {}
    calls: dict[int, set[int]] = {}
    pushed: dict[int, int] = {}
    here = 0
    for line in output_of("avr-objdump", "-d", str(elf)).splitlines():
        if match := FUNCTION.match(line):
            here = int(match[1], 16)
            names[here], calls[here], pushed[here] = match[2], set(), 0
        elif match := CALL.search(line) or ABSOLUTE_CALL.search(line):
            calls[here].add(int(match[1], 16))
        elif INDIRECT.search(line):
            raise SystemExit(f"{elf}: {names[here]} jumps to a computed address: its stack cannot be bounded")
        elif "\tpush\t" in line:
            pushed[here] += 1
    return names, calls, pushed


def deepest(elf: Path) -> int:
    """Stack bytes of the deepest chain of calls from main plus the deepest interrupt; a recursion is an error."""
    names, calls, pushed = call_graph(elf)
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
