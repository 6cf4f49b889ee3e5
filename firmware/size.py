#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Flash, static RAM and an upper bound of the stack of the firmware, each against its limit.

Also where the memory lies that survives a reset: the bootloader must not write there.
In: the ELF. Out: a table; exit status 1 when a limit is exceeded. The bound comes from the disassembly, so that it holds
however the compiler inlines: the deepest chain of calls from main plus the deepest interrupt (interrupts do not nest), and
of each function all that it pushes, and its frame. A computed jump is an error, and so is a stack pointer that is set in
any other way. Owns nothing.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

FUNCTION = re.compile(r"^([0-9a-f]+) <([A-Za-z_][\w.]*)>:\n", re.MULTILINE)
INSTRUCTION = re.compile(r"^ +[0-9a-f]+:\t(?:[0-9a-f]{2} )+(.*)$", re.MULTILINE)
CALL = re.compile(r"r?(?:call|jmp) (?:.*; )?0x([0-9a-f]+)")
COMPUTED = re.compile(r"^(?:e?icall|e?ijmp)\b|<__tablejump2__>$", re.MULTILINE)
FRAME = re.compile(  # in r28, SPL; in r29, SPH; then r29:r28 less its size; or a call of the next instruction, or both
    r"in r28, 0x3d.*\nin r29, 0x3e.*\n(?:sbiw r28, 0x(\w+)|subi r28, 0x(\w+).*\n(?:sbci r29, 0x(\w+))?)?"
)
RESERVE = re.compile(r"^rcall \.\+0\b", re.MULTILINE)  # calls the next instruction, for its two bytes
INTERRUPT = re.compile(r"__vector_\d+$")
RETURN_ADDRESS = 2  # bytes on the stack
START_UP = ("__ctors_end", "__init", "__dtors_end")  # of avr-libc: sets the stack pointer to the end of the memory
BOOTLOADER_WRITES = (0x0300, 0x0800)  # Caterina's variables end below the first address, its key is at the second
DATA_SPACE = 0x800000  # of the ELF


def output_of(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def plain(name: str) -> str:
    """Name of a function in its source, without the ending of a part or copy that the compiler has made (`.isra.0`)."""
    return name.partition(".")[0]


def stack_bytes(name: str, body: str) -> int:
    """What a function itself takes of the stack: return address, pushes on all its ways together, frame."""
    pushed = len(re.findall(r"^push ", body, re.MULTILINE)) + RETURN_ADDRESS * len(RESERVE.findall(body))
    frames = FRAME.findall(body)
    sizes = [int(word or low or "0", 16) + (int(high or "0", 16) << 8) for word, low, high in frames]
    if len(re.findall(r"^out 0x3d, .*\n(?!pop )", body, re.MULTILINE)) > len(frames) and name not in START_UP:  # no end
        raise SystemExit(f"{name} sets the stack pointer: its stack cannot be bounded")
    return RETURN_ADDRESS + pushed + sum(sizes)


def call_graph(listing: str) -> tuple[dict[int, str], dict[int, set[int]], dict[int, int]]:
    """From a disassembly, per function address: its name, the addresses that it calls or jumps to, its stack."""
    names: dict[int, str] = {}
    calls: dict[int, set[int]] = {}
    stacks: dict[int, int] = {}
    parts = FUNCTION.split(listing)[1:]
    for address, name, body in zip(parts[::3], parts[1::3], parts[2::3], strict=True):
        code = [" ".join(text.split()) for text in INSTRUCTION.findall(body)]
        if COMPUTED.search("\n".join(code)):
            raise SystemExit(f"{name} jumps to a computed address: its stack cannot be bounded")
        here = int(address, 16)
        names[here] = plain(name)
        calls[here] = {int(match[1], 16) for match in map(CALL.match, code) if match}
        stacks[here] = stack_bytes(name, "\n".join(code))
    return names, calls, stacks


def deepest(elf: Path) -> int:
    """Stack bytes of the deepest chain of calls from main plus the deepest interrupt; a recursion is an error."""
    names, calls, stacks = call_graph(output_of("avr-objdump", "-d", str(elf)))

    def depth(address: int, callers: tuple[int, ...]) -> int:
        if address in callers:
            raise SystemExit(f"{elf}: {names[address]} calls itself: its stack cannot be bounded")
        inner = (depth(to, (*callers, address)) for to in calls[address] if to in names and to != address)
        return stacks[address] + max(inner, default=0)

    main = next(address for address, name in names.items() if name == "main")
    interrupts = (depth(address, ()) for address, name in names.items() if INTERRUPT.match(name))
    return depth(main, ()) + max(interrupts, default=0)


def kept_memory(elf: Path) -> tuple[int, int]:
    """First address of the variable that survives a reset, and the address behind it."""
    fields = next(f for f in map(str.split, output_of("avr-nm", "-S", str(elf)).splitlines()) if plain(f[-1]) == "kept")
    begin = int(fields[0], 16) - DATA_SPACE
    return begin, begin + int(fields[1], 16)


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
