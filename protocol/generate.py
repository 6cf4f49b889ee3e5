# SPDX-License-Identifier: MIT
"""Make the C and Python codecs, the byte tables and the golden vectors from messages.toml.

In: protocol/messages.toml. Out: the five files named in `outputs()`. `--check` writes nothing and exits 1 when one of them is stale.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from generator.byte_tables import readme
from generator.c_code import c_code, c_header
from generator.python_code import python_code
from generator.schema import Message, board_messages, read_schema
from generator.vectors import vectors

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent


def outputs(messages: list[Message]) -> dict[Path, str]:
    """Every generated file -> the text that it should hold."""
    page = HERE / "README.md"
    return {
        ROOT / "firmware/messages.h": c_header(board_messages(messages)),
        ROOT / "firmware/messages.c": c_code(board_messages(messages)),
        ROOT / "host/core/echostep/board/messages.py": python_code(messages),
        page: readme(messages, page.read_text()),
        HERE / "vectors.jsonl": vectors(messages),
    }


def main() -> int:
    """Write the stale files, or only name them with `--check`."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 when a generated file is stale")
    check = parser.parse_args().check
    stale = {
        path: text
        for path, text in outputs(read_schema(HERE / "messages.toml")).items()
        if not path.exists() or path.read_text() != text
    }
    for path, text in stale.items():
        if not check:
            path.write_text(text)
        print(f"{path.relative_to(ROOT)}: {'stale, run protocol/generate.py' if check else 'written'}")
    return 1 if check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
