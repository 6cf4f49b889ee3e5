# SPDX-License-Identifier: MIT
"""By how many thresholds the filter decides: each is listed, so another one is a line that someone reads."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

from board_runs import ROOT

FILTER = ROOT / "host" / "echostep" / "localization"
LIST = Path(__file__).with_name("thresholds.txt")


def constants(tree: ast.Module) -> Iterator[str]:
    """Names of a module's constants."""
    for statement in tree.body:
        if isinstance(statement, ast.Assign | ast.AnnAssign):
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            yield from (n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name) and n.id.isupper())


def compared(tree: ast.Module) -> Iterator[str]:
    """Names in comparisons."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            yield from (n.id for n in ast.walk(node) if isinstance(n, ast.Name))


def test_each_threshold_of_the_filter_is_listed() -> None:
    trees = {path.relative_to(FILTER).as_posix(): ast.parse(path.read_text()) for path in FILTER.rglob("*.py")}
    used = {name for tree in trees.values() for name in compared(tree)}
    found = {f"{path} {name}" for path, tree in trees.items() for name in constants(tree) if name in used}
    listed = [line for line in LIST.read_text().splitlines() if line and not line.startswith("#")]
    assert len(listed) == len(set(listed))
    assert sorted(found - set(listed)) == []
    assert sorted(set(listed) - found) == []
