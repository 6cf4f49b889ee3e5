# SPDX-License-Identifier: MIT
"""Our recordings in the readers of other programs, as their registries bring them: PyPI, npm."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from command_line import echostep
from echostep_app.recording.repair.contents import info
from walks import DEMO

PYTHON = ["rerun-sdk==0.41.0", "databeam-mcap-reader==0.5.2"]  # the second brings the program mcap 0.0.62
NODE = ["@mcap/core@2.2.2", "@mcap/nodejs@1.0.2"]
INDEXED = """
import { open } from "fs/promises";
import { McapIndexedReader } from "@mcap/core";
import { FileHandleReadable } from "@mcap/nodejs";
const readable = new FileHandleReadable(await open(process.argv[2], "r"));
const reader = await McapIndexedReader.Initialize({ readable });
let count = 0;
for await (const _ of reader.readMessages()) count++;
console.log(count);
"""


def run(*words: str | Path, cwd: Path) -> str:
    done = subprocess.run([*map(str, words)], capture_output=True, text=True, check=False, cwd=cwd)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture
def readers(tmp_path: Path) -> Path:
    """A folder with the readers; the test is skipped where a registry gives none."""
    for words in (
        [sys.executable, "-m", "venv", tmp_path / "env"],
        [tmp_path / "env/bin/pip", "install", "--quiet", *PYTHON],
        ["npm", "install", "--silent", *NODE],
    ):
        try:
            subprocess.run([*map(str, words)], capture_output=True, check=True, cwd=tmp_path)
        except (OSError, subprocess.CalledProcessError) as error:
            pytest.skip(f"no reader to be had: {error}")
    (tmp_path / "read.mjs").write_text(INDEXED)
    return tmp_path


@pytest.mark.long
@pytest.mark.process
def test_every_reader_of_a_registry_finds_every_message(readers: Path) -> None:
    walk = readers / "out/walk.mcap"
    assert echostep("demo", "--plan", DEMO, "--out", walk.parent, "--no-page").returncode == 0
    told = "\n".join(info(walk))
    count = sum(int(n) for pair in re.findall(r"in (\d+) chunks|/[a-z/]+ (\d+)", told) for n in pair if n)
    (mcap,) = readers.glob("env/lib/*/site-packages/databeam_mcap_reader/mcap_cli")
    assert int(run("node", "read.mjs", walk, cwd=readers)) == count
    assert len(run(mcap, "cat", walk, cwd=readers).splitlines()) == count
    run(mcap, "doctor", walk, cwd=readers)
    run(mcap, "sort", walk, "-o", readers / "sorted.mcap", cwd=readers)
    run(readers / "env/bin/rerun", "mcap", "convert", walk, "-o", readers / "walk.rrd", cwd=readers)
    told = run(readers / "env/bin/rerun", "rrd", "stats", readers / "walk.rrd", cwd=readers)
    assert int(re.sub(r"\s", "", told.partition("num_rows = ")[2].splitlines()[0])) >= count
