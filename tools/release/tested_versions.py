# SPDX-License-Identifier: MIT
"""The versions of all packages with which the tests have passed (`make lock`), with the hashes of their files, as requirements for pip.

In: the installed packages; the package index, which uv asks for what other systems and Pythons need, and for the hashes. Out:
host/tested-versions.txt, in two parts: what `make demo` installs, and what `make test` needs besides. Owns that file. `tools/install.py` installs
from it; `make audit` looks for known faults of these versions.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from packaging.utils import canonicalize_name

from places import ROOT
from release.licences import for_developers

FILE = ROOT / "host/tested-versions.txt"
OLDEST = "3.11.2"  # Debian 12's
# Pyproj: longitude and latitude of the demo; hatchling installs the checkout
DEMO = ("./host/core", "./host/app[page,plots]", "pyproj", "hatchling")
OWN = ("echostep", "echostep-app", "echostep-studies")
ALL = ("./host/core", "./host/app[dev]", "./host/studies[cluster]", "hatchling")
HEAD = (
    "# Versions with which the tests have passed, and the hashes of their files, for every system and Python: "
    "written by make lock, installed by make setup, checked by make audit.\n"
)
TESTS = "# What make test needs besides.\n"


def installed() -> str:
    """A line for each installed package that echostep and its tests need."""
    packages = for_developers().items()
    return "".join(f"{canonicalize_name(name)}=={package.version}\n" for name, package in packages)


def resolved(wanted: tuple[str, ...], preferred: str, uv: str) -> str:
    """All that these requirements need on any system and Python, with the hashes of all files; of the preferred versions where they fit."""
    with tempfile.TemporaryDirectory() as folder:
        lines = Path(folder, "versions.txt")
        lines.write_text(preferred)
        own = [word for name in OWN for word in ("--no-emit-package", name)]
        layout = ("--quiet", "--no-header", "--no-annotate", "--generate-hashes", "--output-file", str(lines))
        command = [uv, "pip", "compile", "--universal", "--python-version", OLDEST, *own, *layout, "-"]
        subprocess.run(command, input="\n".join(wanted), cwd=ROOT, stdout=subprocess.DEVNULL, text=True, check=True)
        return "".join(
            line for line in lines.read_text().splitlines(keepends=True) if not line.startswith("#")
        ).lstrip()


def entries(lines: str) -> list[str]:
    """Each package with its hashes."""
    return re.findall(r"^\w.*\n(?: .*\n)*", lines, re.MULTILINE)


def main() -> int:
    """Write the file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--uv", default="uv", help="the program that asks the package index (default uv)")
    uv = parser.parse_args().uv
    everything = entries(resolved(ALL, installed(), uv))
    demo = entries(resolved(DEMO, "".join(everything), uv))
    besides = [entry for entry in everything if entry not in demo]
    FILE.write_text("".join([HEAD, *demo, TESTS, *besides]))
    print(f"{FILE}: {len(everything)} packages, of which {len(demo)} for the demo")
    return 0


if __name__ == "__main__":
    sys.exit(main())
