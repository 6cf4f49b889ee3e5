# SPDX-License-Identifier: MIT
"""Builds the wheels of core and app, installs them in a fresh environment and runs a demo there, without clone, compiler or apt.

In: the two distributions. Out: one line per stage with its time; exit status 1 when a stage fails. Owns a temporary folder.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
import sysconfig
import tempfile
import time
import venv
from collections.abc import Mapping
from pathlib import Path

from places import ROOT

PIP = [sys.executable, "-m", "pip"]


def build(folder: Path, ring: str) -> Path:
    """Build the wheel of `core` or `app` in a folder; raises subprocess.CalledProcessError with the output of pip."""
    options = ["--quiet", "--no-deps", "--no-build-isolation"]
    run([*PIP, "wheel", *options, "-w", folder, ROOT / "host" / ring])
    (wheel,) = folder.glob("echostep-*.whl" if ring == "core" else "echostep_app-*.whl")
    return wheel


def environment(folder: Path, wheels: list[Path], *, borrow: bool) -> Path:
    """A fresh virtual environment with the wheels in it; `borrow`: dependencies are links to this environment; else pip fetches wheels.

    Returns the environment's `bin`.
    """
    venv.create(folder, with_pip=not borrow, symlinks=True)
    python = folder / "bin" / "python"
    if borrow:
        _link_packages(folder)
    offline = ["--no-deps", "--no-index"] if borrow else ["--only-binary", ":all:"]
    run([*PIP, "--python", python, "install", "--quiet", *offline, *wheels])
    return folder / "bin"


def _link_packages(folder: Path) -> None:
    """Link all packages of this environment except echostep."""
    (packages,) = folder.glob("lib/python*/site-packages")
    for entry in Path(sysconfig.get_path("purelib")).iterdir():
        if "echostep" not in entry.name and not (packages / entry.name).exists():
            (packages / entry.name).symlink_to(entry)


def environment_variables(bin_folder: Path, home: Path) -> dict[str, str]:
    """Environment variables without compilers: only the programs of the fresh environment are on the path."""
    return {"PATH": str(bin_folder), "HOME": str(home), "CC": "/nonexistent", "CXX": "/nonexistent"}


def run(command: list[str | Path], env: Mapping[str, str] | None = None, cwd: Path | None = None) -> str:
    """Run a command; returns its output, raises subprocess.CalledProcessError when it fails."""
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=env, cwd=cwd)
    if done.returncode:
        raise subprocess.CalledProcessError(done.returncode, command, done.stdout, done.stderr)
    return done.stdout


def main() -> int:
    """Build, install, run the demo, and run the command with pipx; print the time of each."""
    argparse.ArgumentParser(description="build the wheel, install it afresh, run the demo in there").parse_args()
    start_s = time.monotonic()

    def print_stage(text: str) -> None:
        print(f"{time.monotonic() - start_s:6.0f} s  {text}", flush=True)

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            built = [build(folder, ring) for ring in ("core", "app")]
            for wheel in built:
                print_stage(f"{wheel.name}, {wheel.stat().st_size / 1024:.0f} KB")
                print_stage(f"SHA-256 {hashlib.sha256(wheel.read_bytes()).hexdigest()}")
            programs = environment(folder / "fresh", built, borrow=False)
            size = sum(f.stat().st_size for f in (folder / "fresh").rglob("*") if f.is_file())
            print_stage(f"installed without compiler; {size / 1e6:.0f} MB with all dependencies")
            output = run(
                [programs / "echostep", "demo", "--headless", "--out", folder / "demo"],
                environment_variables(programs, folder),
                folder,
            )
            print_stage(f"echostep demo: {output.splitlines()[-2]}")
            run([programs / "python", "-m", "pip", "install", "--quiet", "pipx"])
            env = {
                **environment_variables(programs, folder),
                "PIP_CONFIG_FILE": os.environ.get("PIP_CONFIG_FILE", "/etc/pip.conf"),
            }
            output = run([programs / "pipx", "run", "--spec", built[0], "echostep", "--help"], env, folder)
            print_stage(f"pipx run echostep --help: {len(output.splitlines())} lines")
        except subprocess.CalledProcessError as error:
            print(f"{error.cmd}\n{error.stdout}{error.stderr}", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
