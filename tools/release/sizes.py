# SPDX-License-Identifier: MIT
"""The size of the project: lines of each ring, words of the pages, the longest files and functions, the fullest folders (in `make check`).

In: the files that git knows; sizes.toml, which has the limits, and its former version. Out: a line for each; exit status 1 where a limit is exceeded,
or has risen. Owns nothing. Generated messages do not count.
"""

from __future__ import annotations

import argparse
import ast
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from places import ROOT

LIMITS = Path(__file__).with_name("sizes.toml")
Limits = dict[str, Any]  # by the names in sizes.toml
CODE = {".py", ".js", ".css", ".html", ".c", ".h", ".sh"}
PARTS = {  # name -> folders; the simulation is in the app's wheel
    "host/core": ["host/core"], "host/app": ["host/app", "host/simulation"], "host/studies": ["host/studies"], "tools": ["tools"],
}  # fmt: skip
GENERATED = "host/core/echostep/board/messages.py"


def files() -> list[Path]:
    """The files that git knows, or would add, relative to the root."""
    listed = _git("ls-files", "--cached", "--others", "--exclude-standard").splitlines()
    return [path for name in listed if (ROOT / (path := Path(name))).is_file()]


def lines(path: Path) -> int:
    """Number of lines of a file."""
    return len((ROOT / path).read_bytes().splitlines())


def functions(path: Path) -> Iterator[tuple[str, int]]:
    """Name and number of lines of each function of a Python file, its signature and docstring included."""
    for node in ast.walk(ast.parse((ROOT / path).read_text())):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            assert node.end_lineno
            yield f"{path}: {node.name}", node.end_lineno - node.lineno + 1


def measured() -> dict[str, dict[str, int]]:
    """By the names in sizes.toml: lines of each part, words of the pages, and all that has a size of its own."""
    known = files()
    code = [path for path in known if path.suffix in CODE and str(path) != GENERATED]
    parts: Counter[str] = Counter()
    for path in code:
        parts["all code"] += lines(path)
        for part, folders in PARTS.items():
            parts[part] += lines(path) * any(map(path.is_relative_to, folders))
    pages = [path for path in known if path.suffix == ".md"]
    parts["words of pages"] = sum(len((ROOT / path).read_text().split()) for path in pages)
    product = [path for path in code if path.is_relative_to("host") and path.suffix == ".py"]
    return {
        "parts": dict(parts),
        "files of a folder": dict(Counter(str(path.parent) for path in product)),
        "lines of a file": {str(path): lines(path) for path in product},
        "lines of a function": dict(item for path in product for item in functions(path)),
    }


def former_limits() -> Limits:
    """The limits before the last change of their file, committed or not; empty where git knows no earlier ones."""
    name = LIMITS.relative_to(ROOT).as_posix()
    here = LIMITS.read_text()
    for commit in _git("log", "--max-count=2", "--format=%H", "--", name).split():
        if (before := _git("show", f"{commit}:{name}")) != here:
            return tomllib.loads(before)
    return {}


def risen(before: Limits, now: Limits) -> list[tuple[str, int, int]]:
    """Name, former limit and present one of each limit that is higher than before."""
    old, new = ({**limits, **limits.get("parts", {})} for limits in (before, now))
    return [(name, old[name], new[name]) for name in old.keys() & new.keys() - {"parts"} if new[name] > old[name]]


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False).stdout


def main() -> int:
    """Print each part's size with its limit, whatever exceeds one, and each limit that has risen."""
    argparse.ArgumentParser(description=__doc__.partition("\n")[0]).parse_args()
    limits, sizes = tomllib.loads(LIMITS.read_text()), measured()
    parts = [(name, size, limits["parts"][name]) for name, size in sizes.pop("parts").items()]
    print(", ".join(f"{name} {size} of {limit}" for name, size, limit in parts))
    over = [(name, size, limit) for name, size, limit in parts if size > limit]
    for kind, each in sizes.items():
        over += [(f"{name}: {kind}", size, limits[kind]) for name, size in sorted(each.items()) if size > limits[kind]]
    for name, size, limit in over:
        print(f"{name}: {size} is above {limit}: let something leave")
    for name, before, now in (higher := risen(former_limits(), limits)):
        print(f"{name}: its limit rose from {before} to {now}: limits only fall")
    return int(bool(over or higher))


if __name__ == "__main__":
    sys.exit(main())
