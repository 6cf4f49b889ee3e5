# SPDX-License-Identifier: MIT
"""`--out` of every command: a folder is a folder, a file is a file, and what an earlier run wrote stays."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer.main

from command_line import echostep
from echostep.offline.imu_csv import Imu
from echostep_app.cli import app
from foot.foot_walks import walking
from offline.imu_files import write
from plan.drawings.drawn_houses import write_house
from walks import DEMO, WALK

KEPT = b"of an earlier run\n"


@pytest.fixture(scope="module")
def imu() -> Imu:
    """A simulated walk of twelve steps."""
    return Imu(*walking(12))


def commands_with_out(group: Any, words: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], str]]:
    """The words of each command that has `--out`, and what it writes: DIR for a folder."""
    for name, command in getattr(group, "commands", {}).items():
        yield from commands_with_out(command, (*words, name))
    for option in group.params:
        if "--out" in option.opts:
            yield words, option.metavar


OUTS = dict(commands_with_out(typer.main.get_command(app)))


@pytest.mark.parametrize("command", OUTS, ids=" ".join)
def test_a_folder_is_a_folder_and_a_file_is_a_file(command: tuple[str, ...], tmp_path: Path) -> None:
    wrong, words = tmp_path / "out", "is a file: --out is a folder"
    if OUTS[command] == "DIR":
        wrong.write_bytes(KEPT)
    else:
        (wrong / "within").mkdir(parents=True)
        words = "is a folder: --out is a file"
    file = ["none.csv"] * (command == ("foot",))  # which looks at its --out when it knows whether there is a plan
    done = echostep(*command, *file, "--out", wrong, cwd=tmp_path)
    assert done.returncode == 2
    assert words in done.stderr
    assert [path.name for path in tmp_path.rglob("*")] == (["out"] if wrong.is_file() else ["out", "within"])


# Commands that need no board: how each is called, and the names of what it writes there
CALLS: dict[str, tuple[tuple[object, ...], tuple[str, ...]]] = {
    "replay": ((WALK, "--plan", DEMO, "--headless", "--out", "."), ("track.csv", "track.png")),
    "export": ((WALK, "--plan", DEMO, "--out", "a.csv"), ("a.csv",)),
    "cut": ((WALK, "--out", "a.mcap"), ("a.mcap",)),
    "repair": ((WALK, "--out", "a.mcap"), ("a.mcap",)),
    "import": (("imu.csv", "--out", "a.mcap"), ("a.mcap",)),
    "foot": (("imu.csv", "--out", "a.csv", "--picture", "a.png"), ("a.csv", "a.png")),
    "floors": (("air.csv", "--heights", "0,3.5", "--out", "a.csv"), ("a.csv",)),
    "plan import": (("house.dxf", "--out", "a.json"), ("a.json", "a.png")),
    "plan show": ((DEMO, "--out", "a.png"), ("a.png",)),
}  # fmt: skip


@pytest.mark.process
@pytest.mark.parametrize("command", CALLS)
def test_nothing_is_overwritten(command: str, tmp_path: Path, imu: Imu) -> None:
    arguments, written = CALLS[command]
    write(tmp_path / "imu.csv", imu)
    write_house(tmp_path / "house.dxf")
    (tmp_path / "air.csv").write_text("t_s,pressure_pa\n" + "".join(f"{k / 2},101325\n" for k in range(200)))
    for name in written:
        (tmp_path / name).write_bytes(KEPT)
    echostep(*command.split(), *arguments, cwd=tmp_path)
    kept = [path.name for path in tmp_path.iterdir() if path.is_file() and path.read_bytes() == KEPT]
    assert len(kept) == len(written), kept


@pytest.mark.process
def test_a_foot_on_a_plan_writes_into_its_folder(tmp_path: Path, imu: Imu) -> None:
    """And another run's track into another one; the track beside them is of neither."""
    write(tmp_path / "imu.csv", imu)
    (tmp_path / "track.csv").write_bytes(KEPT)
    for name in ("one", "two"):
        echostep("foot", "imu.csv", "--plan", DEMO, "--start", "2,7.5,0", "--out", name, cwd=tmp_path, ends=0)
        assert {path.suffix for path in (tmp_path / name).iterdir()} == {".csv", ".png", ".mcap"}
    assert (tmp_path / "track.csv").read_bytes() == KEPT
    assert not list(tmp_path.glob("*.mcap"))
