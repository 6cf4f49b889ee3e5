# SPDX-License-Identifier: MIT
"""A replay of the demo's walk beside the same by another commit: CPU and memory of whole processes, the least of rounds in turn.

In: a commit of the clone. Out: a table of ratios on the terminal. Owns a copy of that commit's sources, and kernels of both, while it runs.
"""

from __future__ import annotations

import argparse
import io
import os
import platform
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[4]
PLAN = ROOT / "host/core/echostep/plans/demo.json"
ECHOSTEP = (sys.executable, "-m", "echostep")
AFRESH = {"PYTHONDONTWRITEBYTECODE": "1", "PYTHONPYCACHEPREFIX": os.devnull}  # where imports keep no bytecode
Costs = tuple[list[tuple[float, float]], list[tuple[float, float]]]  # of this and of the other commit


def cost(command: list[str], more: dict[str, str]) -> tuple[float, float]:
    """CPU (s) of a command and of what it started, and the greatest memory of one process (MB), in an environment with `more`."""
    with subprocess.Popen(command, env=os.environ | more, stdout=subprocess.DEVNULL) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(command)}: exit status {process.returncode}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("commit")
    parser.add_argument("--rounds", type=int, default=10)
    given = parser.parse_args()
    first: Costs = ([], [])
    later: Costs = ([], [])
    afresh: Costs = ([], [])
    with tempfile.TemporaryDirectory() as folder:
        archive = subprocess.run(["git", "archive", given.commit, "host"], cwd=ROOT, check=True, capture_output=True)
        with tarfile.open(fileobj=io.BytesIO(archive.stdout)) as sources:
            sources.extractall(folder, filter="data")
        cost([*ECHOSTEP, "demo", "--headless", "--out", folder], {})
        replay = [
            *ECHOSTEP,
            "replay",
            f"{folder}/walk.mcap",
            "--plan",
            str(PLAN),
            "--headless",
            "--out",
            f"{folder}/replay",
        ]
        sides = [_side(ROOT, f"{folder}/kernels"), _side(Path(folder), f"{folder}/its-kernels")]
        for k, side in enumerate(sides):
            first[k].append(cost(replay, side))
        for _ in range(given.rounds):
            for k, side in enumerate(sides):
                later[k].append(cost(replay, side))
                afresh[k].append(cost(replay, side | AFRESH))
    table = Table("replay", "this", given.commit, "ratio", title=f"{platform.platform()}, {os.cpu_count()} cores")
    rows = {
        "first start, CPU s": (first, 0),
        "CPU s": (later, 0),
        "CPU s without bytecode": (afresh, 0),
        "peak MB": (later, 1),
    }
    for title, (runs, what) in rows.items():
        ours, its = (min(one[what] for one in side) for side in runs)
        table.add_row(title, f"{ours:.2f}", f"{its:.2f}", f"{ours / its:.3f}")
    Console().print(table)


def _side(root: Path, kernels: str) -> dict[str, str]:
    """The environment in which the packages below `root` run, compiled to bytecode, with kernels of their own."""
    packages = sorted({str(path.parent) for path in (root / "host").glob("*/echostep*") if path.is_dir()})
    subprocess.run([sys.executable, "-m", "compileall", "-q", *packages], check=True)
    return {"PYTHONPATH": os.pathsep.join(packages), "NUMBA_CACHE_DIR": kernels}


if __name__ == "__main__":
    main()
