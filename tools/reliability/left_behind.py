# SPDX-License-Identifier: MIT
"""Damages each file that an earlier run left, as a power failure does, and starts the command that reads it again.

In: options. Out: how each command ended; exit status 1 when one raised, gave no clear line, or deleted something. Owns a temporary folder. A
person's own file may be refused in a line that names it; one of the program's own is put aside, and the command goes on.
"""

from __future__ import annotations

import os
import random
import shutil
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from board_runs import ROOT
from command_line import echostep
from places import OUT
from players import pseudo_terminal
from reliability.campaign import CampaignJournal, none, options, report

PLAN, WALK = ROOT / "host/core/echostep/plans/demo.json", ROOT / "tests/captures/walk.mcap"
LAST = b'{"utc": "2026-11-23T12:00:00Z", "plan_sha256": "", "board": "", "place": {"x_m": 2.0, "y_m": 7.5, "sd_m": 0.1, "level": 0}}'
REPLAY = "replay walk.mcap --plan plan.json --headless --out ."
LIVE = "live --plan plan.json --headless --seconds 0.2 --out . --board PORT --start"
OWN, RESULT = "of the program: the command goes on", "made anew by each run"
CASES = {  # by name: the file, what is in it, the command that meets it, whose it is
    "recording": ("walk.mcap", WALK.read_bytes(), REPLAY, ""),
    "recording, repaired": ("walk.mcap", WALK.read_bytes(), "repair walk.mcap -o whole.mcap", ""),
    "plan": ("plan.json", PLAN.read_bytes(), "plan check plan.json", ""),
    "settings": ("s.toml", b"[ranger]\nlearn = false\n", f"{REPLAY} --settings s.toml", ""),
    "settings, calibrated": ("s.toml", b"[ranger]\nlearn = false\n", "calibrate gyros --board PORT --out s.toml", ""),
    "plan in work": ("plan.json", PLAN.read_bytes(), "plan edit plan.json --headless", ""),
    "truth": ("truth.csv", b"t_s,x_m,y_m\n1,1,0\n2,2,0\n", f"{REPLAY} --truth truth.csv", ""),
    "key of a gateway": (
        "key.hex",
        b"0123456789abcdef" * 2,
        f"{LIVE} 2,7.5,0 --beacons udp://127.0.0.1:0?key=key.hex",
        "",
    ),
    "authority": (
        "ca.pem",
        b"-----BEGIN CERTIFICATE-----\nMIIB\n",
        "command mqtts://[::1]:1?ca=ca.pem --plan plan.json --no-page --seconds 0.2",
        "",
    ),
    "track": ("track.csv", b"t_s,x_m\n1,2\n", REPLAY, RESULT),
    "last place": ("last.json", LAST, f"{LIVE} last", OWN),
    "last place, half written": ("last.new", LAST, f"{LIVE} 2,7.5,0", OWN),
    "newest recording": ("walk.link", b"", f"{LIVE} 2,7.5,0", OWN),
}
RNG = random.Random(1)
WAYS: dict[str, Callable[[Path], object]] = {
    "nothing": lambda path: path.write_bytes(b""),
    "half": lambda path: os.truncate(path, path.stat().st_size // 2),
    "zeros": lambda path: path.write_bytes(bytes(path.stat().st_size)),
    "random bytes": lambda path: path.write_bytes(RNG.randbytes(path.stat().st_size)),
    "a folder": lambda path: (path.unlink(), path.mkdir()),
} | ({"not readable": lambda path: path.chmod(0)} if os.geteuid() else {})


@dataclass(frozen=True, slots=True)
class Ended:
    """What is wrong with how the command ended, empty if nothing, and what it said."""

    wrong: str
    said: str = ""


def run_again(case: tuple[str, bytes, str, str], damage: Callable[[Path], object]) -> Ended:
    """Put the file there, damage it, run the command."""
    name, content, command, whose = case
    with tempfile.TemporaryDirectory() as folder, pseudo_terminal() as (_, port):
        for source, copy in ((PLAN, "plan.json"), (WALK, "walk.mcap")):
            shutil.copy(source, Path(folder, copy))
        path = Path(folder, name)
        path.write_bytes(content)
        damage(path)
        before = _content(path)
        try:
            done = echostep(*command.replace("PORT", port).split(), cwd=Path(folder))
        except Exception as error:  # what no code handles is what this looks for
            return Ended(f"raised {error!r}")
        said = (done.stderr.strip().splitlines() or [""])[-1]
        if done.returncode and not said.startswith("echostep: "):
            return Ended("ended without its one line", said)
        if done.returncode and (whose == OWN or name not in said):
            return Ended("does not go on" if whose == OWN else "names another file", said)
        lost = whose != RESULT and before not in [None, *map(_content, Path(folder).iterdir())]
        return Ended("deleted what was there" if lost else "", done.stderr)


def _content(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() and os.access(path, os.R_OK) else None


def main() -> int:
    """Run all and print what was wrong."""
    asked = options(__doc__, out=(OUT / "left_behind.jsonl", "runs so far; they are not made again"))
    runs = {f"{case}: {way}": partial(run_again, CASES[case], WAYS[way]) for case in CASES for way in WAYS}
    rows = CampaignJournal(asked.out).play("left behind", runs, lambda row: row["wrong"] and str(row))
    return report(f"{len(rows)} damaged files", [none("wrong ends", sum(bool(row["wrong"]) for row in rows))])


if __name__ == "__main__":
    sys.exit(main())
