"""What is written about teams is so: the commands run, the schema and its tables are fresh."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import team_schema
from board_runs import ROOT
from echostep.team.report import schema
from team.team_broker import Broker, needs_broker


def test_the_schema_and_its_tables_are_fresh() -> None:
    assert team_schema.SCHEMA.read_text() == schema()
    text = team_schema.TEAMS.read_text()
    assert team_schema.documented(text) == text
    rows = re.findall(r"^\| `[a-z0-9_]+` \|.*$", team_schema.tables(team_schema.tree()), flags=re.M)
    assert len(rows) > 40
    assert all(row.rstrip("| ").count("|") >= 4 for row in rows), "a field without a meaning"


@needs_broker
def test_the_commands_of_the_readme_run(tmp_path: Path) -> None:
    section = (ROOT / "host/README.md").read_text().partition("## Teams")[2]
    block = section.partition("```sh\n")[2].partition("```")[0]
    broker_line, *lines = block.strip().splitlines()
    assert broker_line == "mosquitto -p 18830 &"
    (tmp_path / "host").symlink_to(ROOT / "host")
    with Broker(tmp_path) as broker:
        said = ""
        for line in lines:
            words = shlex.split(line.replace("18830", str(broker.port)))
            assert words[0] == "echostep"
            done = subprocess.run(
                [sys.executable, "-m", *words], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=True,
                env=os.environ | {"COLUMNS": "120"},
            )  # fmt: skip
            said += done.stdout
    assert re.search(r"red/anna +ended", said)
    assert (tmp_path / "team.png").stat().st_size > 10_000
