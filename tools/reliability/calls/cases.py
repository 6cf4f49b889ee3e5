# SPDX-License-Identifier: MIT
"""The commands that are run while calls fail, with what they need: a recording, a port that plays a board.

In: a folder. Out: arguments of each command, the kinds of calls that it makes. Owns the files and the port that the commands read.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from echostep_app.recording.recorder import Recorder
from free_ports import free_port
from places import PLAN
from players import python_board
from walks import walk_chunks

WALK_S = 8.0  # of the recorded walk: a few steps
LISTEN_S = 1.0  # of a live run
NO_BROKER = "mqtt://127.0.0.1:9"  # the port `discard` [RFC 863], where nothing listens


@dataclass(frozen=True, slots=True)
class Case:
    """A command: its arguments, the output folder `OUT` among them as `{out}`; on a terminal or not; the kinds of calls that are to fail."""

    name: str
    arguments: tuple[str, ...]
    kinds: tuple[str, ...]
    on_terminal: bool = False
    repeats: bool = False  # a run makes the same files again, byte by byte but for its recording's name

    def words(self, out: Path) -> list[str]:
        """The command line."""
        return [word.replace("{out}", str(out)) for word in self.arguments]


@contextmanager
def cases(folder: Path) -> Iterator[list[Case]]:
    """All cases; their port plays while the block runs."""
    walk = folder / "walk.mcap"
    with Recorder(walk, {"seed": "1"}) as recorder:
        for chunk in walk_chunks(WALK_S):
            recorder.write(chunk)
    plan, out = ("--plan", str(PLAN)), ("--out", "{out}")
    with python_board() as port:
        ports, files = ("--board", port, "--seconds", str(LISTEN_S)), ("output", "files")
        replay, live = ("replay", str(walk), *plan, *out), ("live", *plan, *ports, *out)
        publish = ("--publish", NO_BROKER, "--name", "Ann")
        export = ("export", str(walk), *plan, "-o", "{out}/track.csv")
        command = ("command", NO_BROKER, *plan, "--seconds", str(LISTEN_S), "--out", "{out}/operation.mcap")
        yield [
            Case("replay on a terminal", (*replay, "--no-page"), ("output",), on_terminal=True, repeats=True),
            Case("replay", (*replay, "--headless"), files, repeats=True),
            Case("demo", ("demo", "--headless", *out), files, repeats=True),
            Case("export", export, files, repeats=True),
            Case("record", ("record", *ports, "--out", "{out}/walk.mcap"), (*files, "ports")),
            Case("live", (*live, "--headless"), (*files, "ports")),
            Case("live with a page", (*live, "--page", "--port", str(free_port()), *publish), ("output", "sockets")),
            Case("command", (*command, "--no-page"), (*files, "sockets")),
        ]
