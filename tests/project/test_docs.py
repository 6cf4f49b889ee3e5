"""The pages say what is so: generated ones are fresh, the tutorial's commands run, all others can be typed as they stand."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import docs
from board_runs import ROOT
from echostep.cli import app
from echostep.plan.model import load_plan

PAGES = sorted((ROOT / "host/docs").glob("*.md"))
TUTORIAL = ROOT / "host/docs/tutorial.md"
CONSOLES = [ROOT / "README.md", ROOT / "host/README.md", *PAGES]


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", page.read_text(), flags=re.S)


def test_the_generated_pages_are_fresh() -> None:
    """`make docs` after a command, a setting or a derived message has changed."""
    for name, text in docs.pages().items():
        assert (ROOT / "host/docs" / name).read_text() == text, f"host/docs/{name} is stale: make docs"


def test_every_command_has_its_section() -> None:
    text = (ROOT / "host/docs/commands.md").read_text()
    usage = subprocess.run(
        [sys.executable, "-m", "echostep", "cut", "--help"],
        capture_output=True,
        text=True,
        check=True,
        env={"COLUMNS": "200"},
    ).stdout
    section = text.split("## echostep cut\n")[1].split("\n## ")[0]
    options = set(re.findall(r"`(--[a-z-]+)`", section))
    assert options == {"--out", "--from", "--to"}
    assert all(option in usage for option in options)
    assert [name for name, _ in docs.commands("echostep", app)][:3] == [
        "echostep demo",
        "echostep live",
        "echostep record",
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text()):
        if not target.startswith("http"):
            assert (page.parent / target).exists(), target


def test_the_tutorials_commands_run_in_their_order(tmp_path: Path) -> None:
    (tmp_path / "host").symlink_to(ROOT / "host")
    (plan,) = blocks(TUTORIAL, "json")
    (tmp_path / "plan.json").write_text(plan)
    said: dict[str, str] = {}
    for line in "".join(blocks(TUTORIAL, "sh")).splitlines():
        program, *arguments = shlex.split(line)
        assert program == "echostep"
        done = subprocess.run(
            [sys.executable, "-m", "echostep", *arguments],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
        )
        assert done.returncode == 0, f"{line}\n{done.stderr}"
        said[arguments[0]] = said.get(arguments[0], "") + done.stdout
    assert set(said) == {"demo", "info", "replay", "cut", "export", "plan"}
    assert "/estimate" in said["info"]
    sha = re.compile(r"sha256 (\w{16})")
    assert sha.findall(said["demo"])[0] == sha.findall(said["replay"])[0]
    for name in ("first/track.png", "first/walk.mcap", "piece/track.csv", "track.parquet", "view.mcap", "plan.png"):
        assert (tmp_path / "out" / name).stat().st_size > 1000


def test_the_tutorials_plan_loads(tmp_path: Path) -> None:
    (plan,) = blocks(TUTORIAL, "json")
    (tmp_path / "plan.json").write_text(plan)
    assert len(load_plan(tmp_path / "plan.json").levels[0].walls) == 10


@pytest.mark.parametrize("page", CONSOLES, ids=lambda page: str(page.relative_to(ROOT)))
def test_what_needs_hardware_can_be_typed_as_it_stands(page: Path) -> None:
    """Its commands and options exist, and its make targets."""
    listed = (ROOT / "host/docs/commands.md").read_text()
    for line in "".join(blocks(page, "console")).splitlines():
        program, *arguments = shlex.split(line, comments=True)
        if program == "make":
            assert re.search(rf"^{arguments[0]}:", (ROOT / "Makefile").read_text(), flags=re.M), line
        elif program.endswith("echostep"):
            words = [word for word in arguments if re.fullmatch(r"[a-z0-9]+", word)][:2]
            name = next(n for k in (2, 1) if f"## {(n := ' '.join(['echostep', *words[:k]]))}\n" in listed)
            section = listed.split(f"## {name}\n")[1].split("\n## ")[0]
            for option in (a for a in arguments if a.startswith("-")):
                assert f"`{option}`" in section, line
        else:
            assert program in ("python3", ".", ".venv/bin/pip", "pip", "pipx", "sudo"), line
