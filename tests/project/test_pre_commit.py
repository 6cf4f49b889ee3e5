# SPDX-License-Identifier: MIT
"""Pre-commit's hooks are the commands of `make check`, no more and no fewer, without any network."""

from __future__ import annotations

import re

import yaml

from board_runs import ROOT

CONFIG = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())


def recipe(target: str) -> list[str]:
    """The commands of a target, with its variables put in."""
    found = re.search(rf"^{target}:.*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert found, target
    lines = [line.strip().removeprefix("@") for line in found[1].splitlines()]
    lines = [line.replace("$(TOOL)", "env PYTHONPATH=tools:tests:tests/app $(BIN)/python -m") for line in lines]
    return [line.replace("$(BIN)", ".venv/bin").replace("$(MAKE)", "make") for line in lines]


def test_the_hooks_are_the_commands_of_make_check() -> None:
    hooks = [hook["entry"] for repo in CONFIG["repos"] for hook in repo["hooks"]]
    assert hooks == recipe("check")
    assert len(hooks) > 5


def test_a_hook_needs_no_network_and_looks_at_everything() -> None:
    assert [repo["repo"] for repo in CONFIG["repos"]] == ["local"]
    for hook in CONFIG["repos"][0]["hooks"]:
        assert (hook["language"], hook["pass_filenames"]) == ("system", False)
        assert "files" not in hook
