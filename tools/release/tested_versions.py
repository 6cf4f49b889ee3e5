# SPDX-License-Identifier: MIT
"""The versions of all packages with which the tests have passed (`make lock`), with the hashes of their files, as requirements for pip.

In: the installed packages; the package index, which uv asks for the hashes. Out: host/tested-versions.txt. Owns that file. `make setup` installs
these versions where the package index has them; `make audit` looks for known faults of them.
"""

from __future__ import annotations

import argparse
import platform
import subprocess
import sys

from packaging.utils import canonicalize_name

from places import ROOT
from release.licences import for_developers

FILE = ROOT / "host/tested-versions.txt"
HEAD = (
    "# Versions with which the tests have passed, and the hashes of their files: "
    "written by make lock, installed by make setup, checked by make audit.\n"
)


def versions() -> str:
    """A line for each package that echostep and its tests need."""
    packages = for_developers().items()
    return "".join(f"{canonicalize_name(name)}=={package.version}\n" for name, package in packages)


def with_hashes(lines: str, uv: str) -> str:
    """The same lines, each followed by the hashes of all files of that version, whatever system and Python they are for."""
    options = ("--quiet", "--no-deps", "--generate-hashes", "--no-header", "--no-annotate", "--python-version")
    command = [uv, "pip", "compile", *options, platform.python_version(), "-"]
    return subprocess.run(command, input=lines, capture_output=True, text=True, check=True).stdout


def main() -> int:
    """Write the file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--uv", default="uv", help="the program that asks the package index (default uv)")
    lines = versions()
    FILE.write_text(HEAD + with_hashes(lines, parser.parse_args().uv))
    print(f"{FILE}: {len(lines.splitlines())} packages")
    return 0


if __name__ == "__main__":
    sys.exit(main())
