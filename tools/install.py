# SPDX-License-Identifier: MIT
"""Install echostep into an environment: `.venv/bin/python tools/install.py demo`, or `tests` for its tests and tools too.

In: host/tested-versions.txt, each of whose packages is checked against its hashes. Out: the packages, in the environment of the Python that runs
this; on a terminal a line with the share that is done. Owns nothing. Where the package index lacks a tested version, the newest ones are
installed, and that is said. A file with another hash is an error. Uses the standard library alone.
"""

from __future__ import annotations

import re
import subprocess
import sys
import sysconfig
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
VERSIONS = ROOT / "host/tested-versions.txt"
DEMO = ("-e", "host/core", "-e", "host/app")
PROJECTS = {"demo": DEMO, "tests": (*DEMO, "-e", "host/studies")}
NEWEST = {
    "demo": ("-e", "host/core", "-e", "host/app[page,plots]", "pyproj"),
    "tests": ("-e", "host/core", "-e", "host/app[dev]", "-e", "host/studies[cluster]"),
}
# Imports compile what they need; where they may not keep it, each start would compile it again
WHEN = "--compile" if sys.dont_write_bytecode else "--no-compile"
PIP = [sys.executable, "-m", "pip", "install", "--disable-pip-version-check", WHEN]


def requirements(part: str) -> str:
    """What a part needs; the demo's requirements come first in the file."""
    text = VERSIONS.read_text()
    return text.partition("# What make test needs")[0] if part == "demo" else text


def install(*words: str, count: int = 0) -> tuple[bool, str]:
    """Whether pip installed it, and what pip printed; of `count` packages the share that is done is shown."""
    site = Path(sysconfig.get_path("purelib"))
    before = len(list(site.glob("*.dist-info")))
    with tempfile.TemporaryFile("w+") as log:

        def printed() -> str:
            log.seek(0)
            return log.read()

        process = subprocess.Popen([*PIP, *words], cwd=ROOT, stdout=log, stderr=subprocess.STDOUT)
        while process.poll() is None:
            if count and sys.stdout.isatty():
                needless, fetched = (
                    len(re.findall(f"^{word} ", printed(), re.MULTILINE)) for word in ("Ignoring", "Collecting")
                )
                put = len(list(site.glob("*.dist-info"))) - before
                share = (fetched + put) / (2 * max(count - needless, 1))
                print(f"\rInstalling {count - needless} packages: {min(share, 1):.0%} ", end="", flush=True)
            time.sleep(0.2)
        if count and sys.stdout.isatty():
            print("\r\033[K", end="")
        return process.returncode == 0, printed()


def tested_pythons() -> list[tuple[int, int]]:
    """The versions of Python that the package is tested on, oldest first."""
    classifiers = re.findall(
        r'"Programming Language :: Python :: 3\.(\d+)"', (ROOT / "host/core/pyproject.toml").read_text()
    )
    return [(3, int(minor)) for minor in classifiers]


def newer_python() -> str:
    """What to do where this Python is newer than all that are tested; empty otherwise."""
    newest = max(tested_pythons())
    if sys.version_info[:2] <= newest:
        return ""
    here, tested = (".".join(map(str, version)) for version in (sys.version_info[:2], newest))
    return (
        f"Python {here} is newer than {tested}, the newest for which every package has wheels "
        f"(for 3.15 lz4 and zstandard have none): say PYTHON=python{tested}"
    )


def set_up(part: str) -> int:
    """Install the tested versions, or the newest; the exit status."""
    with tempfile.TemporaryDirectory() as folder:
        wanted = Path(folder, "requirements.txt")
        wanted.write_text(requirements(part))
        count = len(re.findall(r"^\w", wanted.read_text(), re.MULTILINE))
        done, printed = install("--require-hashes", "-r", str(wanted), count=count)
    if done:
        done, printed = install("--no-deps", "--no-build-isolation", *PROJECTS[part])
    elif "DO NOT MATCH THE HASHES" not in printed:
        print(*re.findall("^ERROR.*", printed, re.MULTILINE), sep="\n")
        print(
            "The package index lacks some tested version: installing the newest ones, without a check of their hashes."
        )
        done, printed = install(*NEWEST[part], count=count)
    if not done:
        print(newer_python() or printed, file=sys.stderr)
    return int(not done)


if __name__ == "__main__":
    sys.exit(set_up(sys.argv[1]))
