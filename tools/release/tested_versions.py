# SPDX-License-Identifier: MIT
"""The versions of all packages with which the tests have passed (`make lock`), as constraints for pip.

In: the installed packages. Out: host/tested-versions.txt. Owns that file. `make setup` installs these versions where the package index has them;
`make audit` looks for known faults of them.
"""

from __future__ import annotations

import argparse
import sys

from packaging.utils import canonicalize_name

from places import ROOT
from release.licences import for_developers

FILE = ROOT / "host/tested-versions.txt"
HEAD = "# The versions with which the tests have passed. Made by make lock; make setup installs them, make audit checks them.\n"


def text() -> str:
    """A line for each package that echostep and its tests need."""
    packages = for_developers().items()
    return HEAD + "".join(f"{canonicalize_name(name)}=={package.version}\n" for name, package in packages)


def main() -> int:
    """Write the file."""
    argparse.ArgumentParser(description=__doc__.partition("\n")[0]).parse_args()
    FILE.write_text(text())
    print(f"{FILE}: {len(text().splitlines()) - 1} packages")
    return 0


if __name__ == "__main__":
    sys.exit(main())
