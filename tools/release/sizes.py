# SPDX-License-Identifier: MIT
"""The size of the project: lines of each ring, words of the pages, the longest files and functions, the fullest folders (in `make check`).

In: the files that git knows; sizes.toml, which has the limits and the reason of each. Out: a line for each; exit status 1 where a limit is exceeded.
Owns nothing. Generated messages do not count.
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

from places import ROOT

LIMITS = Path(__file__).with_name("sizes.toml")
CODE = {".py", ".js", ".css", ".html", ".c", ".h", ".sh"}
GENERATED = "host/core/echostep/board/messages.py"


def files() -> list[Path]:
    """The files that git knows, or would add, relative to the root."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
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
        for part in ("host/core", "host/app", "host/studies", "tools"):
            parts[part] += lines(path) * path.is_relative_to(part)
    pages = [path for path in known if path.suffix == ".md"]
    parts["words of pages"] = sum(len((ROOT / path).read_text().split()) for path in pages)
    product = [path for path in code if path.is_relative_to("host") and path.suffix == ".py"]
    return {
        "parts": dict(parts),
        "files of a folder": dict(Counter(str(path.parent) for path in product)),
        "lines of a file": {str(path): lines(path) for path in product},
        "lines of a function": dict(item for path in product for item in functions(path)),
    }


def main() -> int:
    """Print each part's size with its limit, and whatever exceeds one."""
    argparse.ArgumentParser(description=__doc__.partition("\n")[0]).parse_args()
    limits, sizes = tomllib.loads(LIMITS.read_text()), measured()
    parts = [(name, size, limits["parts"][name]) for name, size in sizes.pop("parts").items()]
    print(", ".join(f"{name} {size} of {limit}" for name, size, limit in parts))
    over = [(name, size, limit) for name, size, limit in parts if size > limit]
    for kind, each in sizes.items():
        over += [(f"{name}: {kind}", size, limits[kind]) for name, size in sorted(each.items()) if size > limits[kind]]
    for name, size, limit in over:
        print(f"{name}: {size} is above {limit}: let something leave, or raise it in {LIMITS.name} with a reason")
    return int(bool(over))


if __name__ == "__main__":
    sys.exit(main())
