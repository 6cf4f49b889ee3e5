# SPDX-License-Identifier: MIT
"""Each `echostep` command of the pages, in blocks, tables and sentences, is run as written, in the order of its page.

A page begins in a folder with what its reader brings (`BROUGHT`): a file that neither those nor an earlier command of the page make is a failure.
What is not run says why (`LEFT_OUT`); its options are checked by test_docs.
"""

from __future__ import annotations

import re
import shlex
import shutil
import sys
from pathlib import Path

import pytest

from board_runs import ROOT
from command_line import echostep
from project.brought_files import (
    captured,
    demo_folder,
    drawing,
    foot,
    foreign,
    legs,
    plan,
    pressure,
    tapped,
    true_path,
    walk,
)
from project.test_docs import NOTEBOOK, PAGES, blocks, name_of
from waiting import ran

LEFT_OUT = {  # beginnings of commands, and why they are not run here
    "live": "ports",
    "doctor": "a board",
    "bench-report": "a board",
    "demo --guide": "a browser",
    r"demo$": "a browser",
    "demo --headless --publish": "a broker; test_docs runs the team's",
    "plan edit": "a browser",
    "command": "a broker; test_docs runs the team's",
    "beacons simulate": "the time of a walk",
    "evaluate": "minutes; tests/studies has small versions",
    "--share COMMAND": "a form",
}
BLANKS = {  # what stands for something, and what is written there
    r"\bX,Y,DEG\b": "2,7.5,0", r"\bX0,Y0,X1,Y1\b": "0,0,10,10", r"(?<=--level )NAME": "'Ground floor'",
    r"(?<=--thigh )M\b": "0.44", r"(?<=--shank )M\b": "0.45", r"\|svg": "", r"(?<=plan import )FILE": "building.dxf",
    r"acc_x,\.\.\.": "acc_x,ay=acc_y,az=acc_z", r"gyr_x,\.\.\.": "gyr_x,gy=gyr_y,gz=gyr_z",
    r"[][]| \.\.\.|(?<=TRACK)\.\.\.": "", r"(?<=/walk-0007-)\*": "20261122T091500Z.mcap",
}  # fmt: skip
BROUGHT = {  # names of what a reader has, and how it is made
    r"(imu|IMU)\.csv": foot, r"building\.dxf": drawing, r"(LEGS|LEFT|RIGHT)\.csv": legs, r"PRESSURE\.csv": pressure,
    r"TRUTH|TRACK": true_path, r"(WALK|WALK2|A|B)\.mcap": walk, r"OLD\.mcap|out/live/walk-0007-.*": captured,
    r"PLAN|PLAN\.json|plan\.json": plan,
}  # fmt: skip
FILE = {"foot": foreign, "import": foot}  # what a FILE is, by its command; others: a recording


def lines(page: Path) -> list[str]:
    """Commands of a page in their order; the name of one alone in a sentence is none."""
    text = page.read_text()
    found: list[str] = []
    for block, span in re.findall(r"```(?:console|sh)\n(.*?)```|```.*?```|`([^`]+)`", text, flags=re.S):
        found += [line.partition(" #")[0].strip() for line in block.splitlines()]
        words = " ".join(span.partition(" | ")[0].split())
        found += [] if re.fullmatch("[a-z]+( [a-z][a-z-]*)*", words) else [words]
    return [line.removeprefix("echostep ") for line in found if line.startswith("echostep ") and "--help" not in line]


def left_out(line: str) -> str:
    """Why a command is not run; empty for one that is."""
    return next((f"{why} ({begin})" for begin, why in LEFT_OUT.items() if re.match(rf"{begin}(?!\S)", line)), "")


def bring(folder: Path, line: str, words: list[str]) -> None:
    """Lay the files into the folder that the reader of the command has; a live run leaves its recording."""
    if words[0] == "live":
        out = folder / (words[words.index("--out") + 1] if "--out" in words else "out/live")
        out.mkdir(parents=True, exist_ok=True)
        if out.name == "corridor":
            tapped(out / "walk.mcap", folder / "plan.json")
        else:
            for name in ("walk.mcap", "walk-0001-20261122T091500Z.mcap"):
                captured(out / name)
    if words[0] == "demo" and "--out" in words:  # run once for all pages
        shutil.copytree(demo_folder(), folder / words[words.index("--out") + 1])
    outputs = {words[k + 1] for k, word in enumerate(words[:-1]) if word in ("-o", "--out", "--picture")}
    for word in set(words) - outputs:
        made = next((make for name, make in BROUGHT.items() if re.fullmatch(name, word)), None)
        if word == "FILE":
            made = next((make for begin, make in FILE.items() if line.startswith(begin)), captured)
        if made and not (word != "FILE" and (folder / word).exists()):
            (folder / word).parent.mkdir(parents=True, exist_ok=True)
            made(folder / word)


LONG = [ROOT / "host/docs/tutorial.md"]
RUN = [
    pytest.param(page, marks=[pytest.mark.long] * (page in LONG), id=name_of(page))
    for page in sorted({*PAGES} - {*NOTEBOOK, ROOT / "host/CHANGELOG.md"})
    if any(not left_out(line) for line in lines(page))
]


@pytest.mark.process
@pytest.mark.parametrize("page", RUN)
def test_the_commands_of_a_page_run_in_their_order(page: Path, tmp_path: Path) -> None:
    for name in ("host", "tests"):
        (tmp_path / name).symlink_to(ROOT / name)
    for example in blocks(page, "json"):
        (tmp_path / "plan.json").write_text(example)
    for line in lines(page):
        typed = line
        for blank, written in BLANKS.items():
            typed = re.sub(blank, written, typed)
        words = shlex.split(typed)
        bring(tmp_path, line, words)
        if not left_out(line) and words[0] != "demo":
            done = echostep(*words, cwd=tmp_path)
            assert done.returncode == 0, f"echostep {line}\n{done.stderr}{done.stdout}"


INSTALLED = {line for page in PAGES for line in re.findall(r"pip install (\./host[^`\n]*)", page.read_text())}


@pytest.mark.long
@pytest.mark.process
@pytest.mark.parametrize("line", sorted(INSTALLED))
def test_an_install_line_of_folders_installs(line: str) -> None:
    """Up to the dependencies, which need the network; lines for PyPI can be run when the packages are there (test_docs checks their extras)."""
    command = [sys.executable, "-m", "pip", "install", "--dry-run", "--no-deps", "--no-index", "--no-build-isolation"]
    done = ran([*command, *shlex.split(line)], cwd=ROOT)
    assert done.returncode == 0, f"pip install {line}\n{done.stderr}"
