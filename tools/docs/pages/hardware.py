# SPDX-License-Identifier: MIT
"""firmware/README.md: its tables of parts, reasons and wires, from firmware/hardware.

In: parts.toml, wiring.toml. Out: the page with its marked tables regenerated. Owns nothing.
"""

from __future__ import annotations

import tomllib
from typing import Any

from docs.pages import END
from hardware import HARDWARE
from hardware.wiring import POWER, WiredBoard, boards

README = HARDWARE.parent / "README.md"
KITS = {"papers": "parts of the papers", "2026": "parts of 2026"}
SEEN = {"maker": "maker", "lists": "lists", "memory": "**memory**", "any": "-"}
Row = dict[str, Any]


def page() -> str:
    """The page with its tables regenerated."""
    made = {f"parts {kit}": parts_table(kit) for kit in KITS}
    made |= {"reasons 2026": reasons_table("2026")}
    made |= {f"wires {board.name}": wires_table(board) for board in boards()}
    text = README.read_text(encoding="utf-8")
    for name, table in made.items():
        begin = f"<!-- made by make docs: {name} -->\n"
        before, mark, rest = text.partition(begin)
        if not mark:
            raise SystemExit(f"{README}: has no mark {begin.strip()}")
        text = before + begin + table + END + rest.partition(END)[2]
    return text


def parts() -> list[Row]:
    """The rows of the bill of materials."""
    rows: list[Row] = tomllib.loads((HARDWARE / "parts.toml").read_text(encoding="utf-8"))["part"]
    return rows


def parts_table(kit: str) -> str:
    """What to order for a kit, and its cost as an order of magnitude."""
    head = "| role | part | order | sold by | bus, supply | count | EUR each | number seen |\n" + "|---" * 8 + "|\n"
    body, total = "", 0
    for row in (row for row in parts() if kit in row["kits"]):
        count = row["count"][kit]
        total += count * row["eur"]
        seen = SEEN[row["source"]]
        bus = ", ".join(text for text in (row["bus"], row["supply"]) if text)
        cells = (row["role"], row["part"], row["order"], row["sold"], bus, count, row["eur"], seen)
        body += f"| {' | '.join(str(cell) for cell in cells)} |\n"
    return head + body + f"\nTogether about {_rounded(total)} EUR.\n"


def reasons_table(kit: str) -> str:
    """How the firmware knows each part of a kit, why it was chosen, and what serves when it is gone."""
    rows = [row for row in parts() if kit in row["kits"] and "instead" in row]
    head = "| role | part | identity register | why this one | when it is gone |\n|---|---|---|---|---|\n"
    cells = ((row["role"], row["part"], row.get("identity", "-"), row["why"], row["instead"]) for row in rows)
    return head + "".join(f"| {' | '.join(texts)} |\n" for texts in cells)


def wires_table(board: WiredBoard) -> str:
    """All wires of a board: each net, the processor's pin, and the pins of the parts."""
    ends: dict[str, list[str]] = {}
    for device in board.devices:
        for pin, net in device.pins.items():
            ends.setdefault(net, []).append(f"{device.name} {pin}")
    rows = "| on the Micro | processor | signal | to |\n|---|---|---|---|\n"
    for net in (*board.pins, *sorted(ends.keys() - board.pins.keys() - POWER.keys()), *POWER):
        if net in ends:
            processor = board.pins.get(net)
            on_board, port = (processor.board, processor.port) if processor else (net if net in POWER else "-", "")
            rows += f"| {on_board} | {port} | {net} | {', '.join(ends[net])} |\n"
    return rows


def _rounded(eur: int) -> int:
    """A cost with one significant digit in its tens."""
    step = 10 if eur < 300 else 100
    return round(eur / step) * step
