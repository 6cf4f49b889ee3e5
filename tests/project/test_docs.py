# SPDX-License-Identifier: MIT
"""The pages are true: generated ones are fresh, links lead somewhere, commands run or exist, examples work, promises name their tests."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import typer

from board_runs import ROOT
from command_line import echostep
from docs import generate
from docs.pages import teams
from echostep.plan import load_plan
from echostep_app.cli import app
from team.team_broker import Broker, needs_broker

MANUAL = sorted((ROOT / "host/docs").glob("*.md"))
DESIGN = sorted((ROOT / "host/docs/design").glob("*.md"))
DECISIONS = sorted((ROOT / "host/docs/decisions").glob("*.md"))
NOTEBOOK = sorted((ROOT / "host/studies/notebook").glob("*.md"))
RESULTS = sorted((ROOT / "host/docs/results").glob("*.md"))
SERIES = (DESIGN, DECISIONS, NOTEBOOK)
BESIDE = "README.md host/README.md host/CHANGELOG.md host/CONTRIBUTING.md host/SECURITY.md protocol/README.md firmware/README.md firmware/bench.md"
PAGES = [ROOT / name for name in (*BESIDE.split(), "firmware/hardware/README.md", "tools/twin/README.md")]
PAGES += [*MANUAL, *DESIGN, *DECISIONS, *NOTEBOOK, *RESULTS]
# That console blocks may call besides echostep and make
PROGRAMS = ("python3", ".", ".venv/bin/pip", "pip", "pipx", "sudo")
SOURCE = "\n".join(
    path.read_text()
    for folder in ("host/core", "host/simulation", "host/app", "host/studies", "protocol", "firmware")
    for path in sorted((ROOT / folder).rglob("*"))
    if path.suffix in {".py", ".toml", ".c", ".h", ".js"}
)

RINGS = (ROOT / "host/core/echostep", ROOT / "host/simulation", ROOT / "host/app/echostep_app")


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", page.read_text(), flags=re.S)


def test_the_generated_pages_are_fresh() -> None:
    """`make docs` after a command, a setting, a public docstring, a report or a derived message has changed."""
    for path, text in generate.pages().items():
        assert path.read_text() == text, f"{path} is stale: make docs"


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text()):
        if not target.startswith("http"):
            assert (page.parent / target).exists(), target


def test_the_manual_lists_every_page() -> None:
    listed = (ROOT / "host/docs/README.md").read_text()
    assert [page.name for page in MANUAL if f"({page.name})" not in listed] == ["README.md"]
    assert [page.name for page in RESULTS if f"(results/{page.name})" not in listed] == []
    assert len(MANUAL) + len(RESULTS) <= 30


@pytest.mark.parametrize("series", SERIES, ids=("design", "decisions", "notebook"))
def test_a_series_lists_its_pages(series: list[Path]) -> None:
    """A page lies beside the README that lists it once in a table."""
    (index,) = [page for page in series if page.name == "README.md"]
    rows = "\n".join(re.findall(r"^\|.*\|$", index.read_text(), flags=re.M))
    assert len(series) > 10
    for page in series:
        assert page == index or f"]({page.name})" in rows, page.name


@pytest.mark.parametrize("page", DESIGN, ids=name_of)
def test_a_name_in_the_design_stands_in_the_code(page: Path) -> None:
    """`Class.method`, `function_name` and `CONSTANT` of the text, wherever in the package, the settings or the protocol."""
    for name in re.findall(r"`(?:[A-Za-z_]\w*\.)?(_?[A-Za-z]\w*)`", page.read_text()):
        assert re.search(rf"\b{re.escape(name)}\b", SOURCE), name


@pytest.mark.parametrize("page", [page for page in PAGES if page.parent != ROOT / "protocol"], ids=name_of)
def test_a_named_file_of_the_project_exists(page: Path) -> None:
    """`foot/ins.py` and the like in the text."""
    roots = (ROOT, *RINGS, page.parent)
    for path in re.findall(r"`((?:[\w.-]+/)+[\w-]+\.(?:py|c|h|toml|js|md))`", page.read_text()):
        assert "NAME" in path or any((root / path).exists() for root in roots), path


@pytest.mark.parametrize("flow", ["echo", "step", "tap", "plan file"])
def test_a_code_flow_names_what_its_files_hold(flow: str) -> None:
    """Each `name` of a code flow stands in one of the files that the flow names."""
    page = (ROOT / "host/docs/design/data-path.md").read_text()
    text = page.partition(f"## Code flow of one {flow}\n")[2].partition("\n## ")[0].partition("\n|")[0]
    files = re.findall(r"`([\w/]+\.(?:py|c|js))`", text)
    assert len(files) > 3
    source = "".join(next(p for root in (ROOT, *RINGS) if (p := root / path).exists()).read_text() for path in files)
    for name in re.findall(r"`(?:[A-Z]\w+\.)?(\w+)`", text):
        assert re.search(rf"\b{name}\b", source), name


@pytest.mark.process
def test_every_make_target_that_is_named_exists() -> None:
    listed = subprocess.run(["make", "-s", "help"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    targets = {line.split()[0] for line in listed.splitlines()}
    assert {"setup", "firmware", "twin", "demo", "test", "check", "size", "bench", "flash", "clean", "help"} <= targets
    assert {m for page in PAGES for m in re.findall(r"`make ([a-z-]+)", page.read_text())} <= targets


def test_every_field_of_plan_and_report_is_explained() -> None:
    plan = [row.split("|") for row in (ROOT / "host/docs/plan.md").read_text().splitlines() if row.startswith("| `")]
    fields = [cells for cells in plan if len(cells) == 6]
    assert len(fields) > 30
    assert all(cells[4].strip() for cells in fields)
    rows = re.findall(r"^\| `[a-z0-9_]+` \|.*$", teams.tables(teams.tree()), flags=re.M)
    assert len(rows) > 40
    assert all(row.rstrip("| ").count("|") >= 4 for row in rows), "a field without a meaning"


@pytest.mark.process
def test_the_example_in_python_runs(tmp_path: Path) -> None:
    (example,) = blocks(ROOT / "host/README.md", "python")
    (tmp_path / "board.bin").write_bytes((ROOT / "tests/captures/board.bin").read_bytes())
    done = subprocess.run([sys.executable, "-c", example], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert len(done.stdout.splitlines()) > 40


@pytest.mark.parametrize(("page", "walls"), [("plan", 5), ("tutorial", 10)])
def test_the_plans_of_the_manual_load(tmp_path: Path, page: str, walls: int) -> None:
    (example,) = blocks(ROOT / f"host/docs/{page}.md", "json")
    (tmp_path / "plan.json").write_text(example)
    plan = load_plan(tmp_path / "plan.json")
    assert plan.start is not None
    assert len(plan.levels[0].walls) == walls


@pytest.mark.long
@needs_broker
def test_the_commands_for_a_team_run(tmp_path: Path) -> None:
    (block,) = blocks(ROOT / "host/docs/teams.md", "sh")
    broker_line, *lines = block.strip().splitlines()
    assert broker_line == "mosquitto -p 18830 &"
    (tmp_path / "host").symlink_to(ROOT / "host")
    printed = ""
    with Broker(tmp_path) as broker:
        for line in lines:
            program, *arguments = shlex.split(line.replace("18830", str(broker.port)))
            assert program == "echostep"
            done = echostep(*arguments, cwd=tmp_path, env=os.environ | {"COLUMNS": "120"}, ends=0)
            printed += done.stdout
    assert re.search(r"red/anna: run ended", printed)


@pytest.mark.parametrize("page", [ROOT / "README.md", ROOT / "host/README.md", *MANUAL], ids=name_of)
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
            assert program in PROGRAMS, line


def spans(page: Path, program: str) -> list[str]:
    """Lines of a program in sentences and tables, without the brackets of what may be left out."""
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.S)
    found = [" ".join(span.split()) for span in re.findall(r"`([^`]+)`", text)]
    return [span for span in found if span.startswith(f"{program} ")]


@pytest.mark.parametrize("page", [*sorted({*PAGES} - {*NOTEBOOK}), ROOT / "host/studies/README.md"], ids=name_of)
def test_a_command_in_a_sentence_can_be_typed_as_it_stands(page: Path) -> None:
    """As the command line takes it; the name of a command may stand alone."""
    for span in spans(page, "echostep"):
        line = re.sub(r"[][]| \.\.\.|\|svg", "", span.partition(" | ")[0])
        parse(re.sub(r" [NM]\b", " 1", line.replace("COMMAND", "demo")))


def parse(line: str) -> None:
    """A command, alone or with what it takes, as the command line parses it; it is not run."""
    _, *words = shlex.split(line)
    command = typer.main.get_command(app)
    while hasattr(command, "resolve_command") and words and not words[0].startswith("-"):
        _, command, words = command.resolve_command(command.make_context("echostep", ["x"]), words)
    if words and words != ["--help"]:
        try:
            command.make_context("echostep", words)
        except typer._click.exceptions.ClickException as error:
            pytest.fail(f"{line}: {error.format_message()}")


@pytest.mark.parametrize(
    "name", ["demo", "live", "record", "replay", "foot", "import", "score", "export", "plan import", "plan check"]
)
def test_the_example_of_a_help_can_be_typed_as_it_is_printed(name: str) -> None:
    (line,) = re.findall(rf"^ +(echostep {name} .*)$", echostep(*name.split(), "--help").stdout, flags=re.M)
    parse(line)


@pytest.mark.parametrize("page", [*PAGES, ROOT / "host/docs/notebooks/README.md"], ids=name_of)
def test_an_install_line_names_what_there_is(page: Path) -> None:
    """In sentences, tables and blocks: extras that exist, folders that exist."""
    project = tomllib.loads((ROOT / "host/core/pyproject.toml").read_text())["project"]
    in_blocks = re.findall(r"^(?:\S*/)?(pipx? install .*)$", "\n".join(blocks(page, "console")), flags=re.M)
    for span in (*spans(page, "pip"), *spans(page, "pipx"), *in_blocks):
        for word in shlex.split(span.partition("&&")[0], comments=True)[2:]:
            path, _, extras = word.partition("[")
            if path.startswith("."):
                assert (ROOT / path / "pyproject.toml").exists(), span
            elif path == "echostep" and extras:
                assert set(extras.rstrip("]").split(",")) <= set(project["optional-dependencies"]), span


def test_a_question_about_the_code_is_answered_in_two_hops() -> None:
    """README -> design/README, whose table names files, and functions that stand in one of them."""
    assert "(host/docs/design/README.md)" in (ROOT / "README.md").read_text()
    where = (ROOT / "host/docs/design/README.md").read_text().partition("## Where is ...\n")[2]
    rows = [row.split("|")[1:3] for row in where.splitlines() if row.startswith("| ")][1:]
    assert len(rows) > 10
    for question, answer in rows:
        files = re.findall(r"`([\w/]+\.(?:py|toml))`", answer)
        roots = [root / path for path in files for root in (ROOT, *RINGS) if (root / path).exists()]
        assert len(roots) == len(files) > 0, question
        source = "".join(path.read_text() for path in roots)
        for name in re.findall(r"`(?:[A-Z]\w+\.)?(\w+)`", answer):
            assert re.search(rf"\b{name}\b", source), (question, name)


SECURITY = "host/SECURITY.md"  # several tables, whose last column names the test; what is not defended has none
PROMISES = {
    "host/docs/recordings.md": r"## What is promised\n(.*?)\n## ",
    SECURITY: "(.*)## Not defended",
}  # page -> the part with its tables
NAMED = re.compile(r"`(?:tests/)?([\w/]+\.py)::(\w+)`")  # a test, its file from tests/ on


@pytest.mark.parametrize(("page", "least"), [("host/docs/recordings.md", 5), (SECURITY, 30)])
def test_each_promise_names_its_test(page: str, least: int) -> None:
    (promised,) = re.findall(PROMISES[page], (ROOT / page).read_text(), flags=re.S)
    rows = [
        line
        for line in promised.splitlines()
        if line.startswith("| ") and not re.search(r"\| (test|shown by) \|$", line)
    ]
    assert len(rows) > least
    assert not [row for row in rows if not NAMED.search(row.rsplit(" | ", 1)[1])]


@pytest.mark.parametrize("page", PROMISES)
def test_the_named_tests_exist(page: str) -> None:
    for file, name in NAMED.findall((ROOT / page).read_text()):
        path = ROOT / "tests" / file
        assert path.is_file(), f"{page}: no file tests/{file}"
        assert f"\ndef {name}(" in path.read_text(), f"{page}: tests/{file} has no {name}"
