"""What the READMEs say is so: their commands exist, their examples run, their links lead somewhere."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from board_runs import ROOT
from echostep.plan.model import load_plan

READMES = [
    "README.md",
    "host/README.md",
    "host/DESIGN.md",
    "host/TEAMS.md",
    "protocol/README.md",
    "firmware/README.md",
    "tools/twin/README.md",
]


def blocks(readme: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", (ROOT / readme).read_text(), flags=re.S)


@pytest.mark.parametrize("readme", READMES)
def test_links_lead_somewhere(readme: str) -> None:
    text = (ROOT / readme).read_text()
    for target in re.findall(r"\]\(([^)#]+)\)", text):
        if not target.startswith("http"):
            assert ((ROOT / readme).parent / target).exists(), target


def test_every_make_target_that_is_named_exists() -> None:
    listed = subprocess.run(["make", "-s", "help"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    targets = {line.split()[0] for line in listed.splitlines()}
    assert {"setup", "firmware", "twin", "demo", "test", "check", "size", "bench", "flash", "clean", "help"} <= targets
    named = {m for readme in READMES for m in re.findall(r"`make ([a-z]+)", (ROOT / readme).read_text())}
    assert named <= targets


def test_the_readme_has_exactly_two_commands() -> None:
    assert [block.strip() for block in blocks("README.md", "sh")] == ["make demo", "make test"]


def test_the_plan_of_the_readme_loads(tmp_path: Path) -> None:
    (example,) = blocks("host/README.md", "json")
    (tmp_path / "plan.json").write_text(example)
    assert load_plan(tmp_path / "plan.json").start is not None


def test_the_example_of_the_readme_runs(tmp_path: Path) -> None:
    (example,) = blocks("host/README.md", "python")
    (tmp_path / "board.bin").write_bytes((ROOT / "tests/captures/board.bin").read_bytes())
    done = subprocess.run([sys.executable, "-c", example], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert len(done.stdout.splitlines()) > 40


@pytest.mark.parametrize(
    "command",
    [
        "demo",
        "live",
        "record",
        "replay",
        "foot",
        "decode",
        "doctor",
        "flash",
        "calibrate",
        "command",
        "beacons simulate",
        *(
            f"evaluate {name}"
            for name in (
                "feet",
                "girard2011",
                "echoes",
                "trails",
                "fischer2008",
                "lee2010",
                "legs",
                "floors",
                "storeys",
            )
        ),
    ],
)
def test_every_option_that_is_named_exists(command: str) -> None:
    usage = subprocess.run(
        [sys.executable, "-m", "echostep", *command.split(), "--help"],
        capture_output=True,
        text=True,
        check=True,
        env={"COLUMNS": "200"},
    ).stdout
    rows = [
        line for line in (ROOT / "host/README.md").read_text().splitlines() if line.startswith(f"| `echostep {command}")
    ]
    assert rows
    for option in re.findall(r"--[a-z-]+", rows[0].split("|")[1]):
        assert option in usage


def test_a_wheel_holds_everything_that_the_demo_needs(tmp_path: Path) -> None:
    built = subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", tmp_path, ROOT / "host"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if "hatchling" in built.stderr and built.returncode:
        pytest.skip("hatchling is not installed in this environment")
    assert built.returncode == 0, built.stderr
    (wheel,) = tmp_path.glob("*.whl")
    listed = subprocess.run(
        [sys.executable, "-m", "zipfile", "-l", wheel], capture_output=True, text=True, check=True
    ).stdout
    assert "echostep/plans/demo.json" in listed
    assert "echostep/firmware/echostep.hex" in listed
    assert "echostep/firmware/99-echostep.rules" in listed
    assert "__pycache__" not in listed
