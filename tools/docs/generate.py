# SPDX-License-Identifier: MIT
"""The pages that are made from the code and from tables, written or compared (`make docs`, `make check`).

In: the installed package, firmware/hardware. Out: host/docs/*.md, report.schema.json, tables of firmware/README.md.
`--check` writes nothing and exits 1 when one is stale. Owns nothing.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from docs.pages import DOCS, commands, hardware, plan, python, recordings, settings, teams
from echostep_app.team.messages.report import schema


def pages() -> dict[Path, str]:
    """The text of each file by its path."""
    made = (commands, settings, recordings, plan, teams, python)
    texts = {DOCS / f"{module.__name__.rpartition('.')[2]}.md": module.page() for module in made}
    return texts | {teams.SCHEMA: schema(), hardware.README: hardware.page()}


def main() -> int:
    """Write the files, or report which are stale."""
    parser = argparse.ArgumentParser(description="make the reference pages")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 when a page is stale")
    check, stale = parser.parse_args().check, False
    for path, text in pages().items():
        if path.exists() and path.read_text() == text:
            continue
        stale = True
        if not check:
            path.write_text(text)
        print(f"{path}: {'stale, run make docs' if check else 'written'}")
    return int(check and stale)


if __name__ == "__main__":
    sys.exit(main())
