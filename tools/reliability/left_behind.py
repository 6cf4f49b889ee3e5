# SPDX-License-Identifier: MIT
"""Damages each file that an earlier run left, as a power failure does, and starts the command that reads it again.

In: options. Out: how each command ended; exit status 1 when one raised an exception, gave no clear line, or deleted what was there. Owns a
temporary folder. A person's own file (plan, settings, recording) may be refused in one line that names it; a file of the program's own is put aside,
and the command goes on. Compiled kernels have a test of their own.
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
from reliability.campaign import CampaignJournal, Figure, none, options, report

PLAN, WALK = (ROOT / name for name in ("host/core/echostep/plans/demo.json", "tests/captures/walk.mcap"))
LAST = '{"utc": "2026-11-23T12:00:00Z", "plan_sha256": "", "board": "", "place": {"x_m": 2.0, "y_m": 7.5, "sd_m": 0.1, "level": 0}}'


@dataclass(frozen=True, slots=True)
class Left:
    """A file that a run left, what was in it, and the command that meets it; `own`: of the program, so that the command must go on.

    `replaced`: a result, which the next run writes anew.
    """

    file: str
    content: bytes | Path
    command: tuple[str, ...]
    own: bool = False
    replaced: bool = False


@dataclass(frozen=True, slots=True)
class Ended:
    """How the command ended: what is wrong with that, empty if nothing, and its last line."""

    wrong: str
    said: str


REPLAY = ("replay", "walk.mcap", "--plan", "plan.json", "--headless", "--out", ".")
LIVE = ("live", "--plan", "plan.json", "--headless", "--seconds", "0.2", "--out", ".", "--board")
CASES = {
    "recording": Left("walk.mcap", WALK, REPLAY),
    "recording, repaired": Left("walk.mcap", WALK, ("repair", "walk.mcap", "-o", "whole.mcap")),
    "recording, told of": Left("walk.mcap", WALK, ("info", "walk.mcap")),
    "plan": Left("plan.json", PLAN, ("plan", "check", "plan.json")),
    "settings": Left("s.toml", b"[ranger]\nlearn = false\n", (*REPLAY, "--settings", "s.toml")),
    "track": Left("track.csv", b"t_s,x_m\n1,2\n", REPLAY, replaced=True),
    "track, scored": Left("track.csv", b"t_s,x,y,z,heading_rad,stance\n1,2,3,0,0,1\n", ("score", "track.csv", "--truth", "track.csv")),
    "last place": Left("last.json", LAST.encode(), (*LIVE, "PORT", "--start", "last"), own=True),
    "last place, half written": Left("last.new", LAST.encode(), (*LIVE, "PORT", "--start", "2,7.5,0"), own=True),
    "newest recording": Left("walk.link", b"", (*LIVE, "PORT", "--start", "2,7.5,0"), own=True),
}  # fmt: skip


def damages(rng: random.Random) -> dict[str, Callable[[Path], object]]:
    """What a power failure or a wrong hand leaves in the place of a file."""

    def folder(path: Path) -> None:
        path.unlink()
        path.mkdir()

    known: dict[str, Callable[[Path], object]] = {
        "nothing": lambda path: path.write_bytes(b""),
        "half": lambda path: os.truncate(path, path.stat().st_size // 2),
        "zeros": lambda path: path.write_bytes(bytes(path.stat().st_size)),
        "random bytes": lambda path: path.write_bytes(rng.randbytes(path.stat().st_size)),
        "a folder": folder,
    }
    return known if os.geteuid() == 0 else known | {"not readable": lambda path: path.chmod(0)}


def run_again(left: Left, damage: Callable[[Path], object]) -> Ended:
    """Put the file there, damage it, run the command."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for source, file in ((PLAN, "plan.json"), (WALK, "walk.mcap")):
            shutil.copy(source, folder / file)
        path = folder / left.file
        path.write_bytes(left.content if isinstance(left.content, bytes) else left.content.read_bytes())
        damage(path)
        before = path.read_bytes() if path.is_file() and os.access(path, os.R_OK) else None
        ours, theirs = os.openpty()
        try:
            done = echostep(*(os.ttyname(theirs) if word == "PORT" else word for word in left.command), cwd=folder)
        except Exception as error:  # what no code handles is what this looks for
            return Ended(f"raised {error!r}", "")
        finally:
            os.close(ours)
            os.close(theirs)
        there = [file.read_bytes() for file in folder.iterdir() if file.is_file() and os.access(file, os.R_OK)]
        lines = done.stderr.strip().splitlines() or [""]
        wrong = ""
        if done.returncode and not (done.returncode in (1, 2) and lines[-1].startswith("echostep: ")):
            wrong = f"status {done.returncode} without its one line"
        elif done.returncode and (left.own or left.file not in lines[-1]):
            wrong = "does not go on" if left.own else "names another file"
        elif before is not None and not left.replaced and before not in there:
            wrong = "deleted what was there"
        return Ended(wrong, lines[-1])


def main() -> int:
    """Run all and print what was wrong."""
    asked = options(
        __doc__,
        out=(OUT / "left_behind.jsonl", "runs so far; they are not made again"),
        only=([*CASES], "files"),
        seed=(1, "of the random bytes"),
    )
    ways = damages(random.Random(asked.seed))
    runs = {f"{case}: {way}": partial(run_again, CASES[case], ways[way]) for case in asked.only for way in ways}
    rows = CampaignJournal(asked.out).play(
        "left behind", runs, lambda row: f"{row['name']}: {row['wrong']} ({row['said']})" * bool(row["wrong"])
    )
    refused = sum(bool(row["said"]) for row in rows)
    return report(
        f"{len(rows)} damaged files",
        [
            Figure("told in a line", f"{refused}"),
            none(
                "exceptions, other files named, things deleted, runs that do not go on",
                sum(bool(row["wrong"]) for row in rows),
            ),
        ],
    )


if __name__ == "__main__":
    sys.exit(main())
