"""Build the wheel and use it as somebody would who has nothing else: no clone, no compiler, no apt.

In: the host package. Out: a wheel, a fresh environment with it, what a demo in there says, and how long each took; exit status 1 when something
fails. Owns a temporary folder.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import sysconfig
import tempfile
import time
import venv
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def build(folder: Path) -> Path:
    """The wheel, built into a folder; raises subprocess.CalledProcessError with what pip said."""
    run(
        [
            sys.executable,
            "-m",
            "pip",
            "wheel",
            "--quiet",
            "--no-deps",
            "--no-build-isolation",
            "-w",
            folder,
            ROOT / "host",
        ]
    )
    (wheel,) = folder.glob("echostep-*.whl")
    return wheel


def environment(folder: Path, wheel: Path, *, borrow: bool) -> Path:
    """A fresh virtual environment with the wheel in it; `borrow`: its dependencies are those of this environment, else pip fetches wheels.

    Returns the environment's `bin`.
    """
    venv.create(folder, with_pip=not borrow, symlinks=True)
    python = folder / "bin" / "python"
    if borrow:
        _borrow(folder)
    offline = ["--no-deps", "--no-index"] if borrow else ["--only-binary", ":all:"]
    run([sys.executable, "-m", "pip", "--python", python, "install", "--quiet", *offline, wheel])
    return folder / "bin"


def _borrow(folder: Path) -> None:
    """Links to everything that is installed here, but for the package itself."""
    (packages,) = folder.glob("lib/python*/site-packages")
    for entry in Path(sysconfig.get_path("purelib")).iterdir():
        if "echostep" not in entry.name and not (packages / entry.name).exists():
            (packages / entry.name).symlink_to(entry)


def bare(bin_folder: Path, home: Path) -> dict[str, str]:
    """The surroundings of somebody without compilers: nothing but the environment's own programs."""
    return {"PATH": str(bin_folder), "HOME": str(home), "CC": "/nonexistent", "CXX": "/nonexistent"}


def run(command: list[str | Path], env: Mapping[str, str] | None = None, cwd: Path | None = None) -> str:
    """What a command printed; raises subprocess.CalledProcessError."""
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=env, cwd=cwd)
    if done.returncode:
        raise subprocess.CalledProcessError(done.returncode, command, done.stdout, done.stderr)
    return done.stdout


def main() -> int:
    """The whole way, timed: wheel, fresh environment, demo; the same by pipx."""
    argparse.ArgumentParser(description="build the wheel, install it afresh, run the demo in there").parse_args()
    began = time.monotonic()

    def said(what: str) -> None:
        print(f"{time.monotonic() - began:6.0f} s  {what}", flush=True)

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            wheel = build(folder)
            said(f"{wheel.name}, {wheel.stat().st_size / 1024:.0f} KB")
            programs = environment(folder / "fresh", wheel, borrow=False)
            size = sum(f.stat().st_size for f in (folder / "fresh").rglob("*") if f.is_file())
            said(f"installed without compiler; {size / 1e6:.0f} MB with all dependencies")
            told = run(
                [programs / "echostep", "demo", "--headless", "--out", folder / "demo"], bare(programs, folder), folder
            )
            said(f"echostep demo: {told.splitlines()[-2]}")
            run([programs / "python", "-m", "pip", "install", "--quiet", "pipx"])
            env = {**bare(programs, folder), "PIP_CONFIG_FILE": os.environ.get("PIP_CONFIG_FILE", "/etc/pip.conf")}
            told = run([programs / "pipx", "run", "--spec", wheel, "echostep", "--help"], env, folder)
            said(f"pipx run echostep --help: {len(told.splitlines())} lines")
        except subprocess.CalledProcessError as error:
            print(f"{error.cmd}\n{error.stdout}{error.stderr}", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
