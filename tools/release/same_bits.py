# SPDX-License-Identifier: MIT
"""Digests of everything that a refactoring must not change, to be compared between two checkouts.

In: the recordings' folder ($ECHOSTEP_DATA or ../shared/data), the twin when it is built. Out: one line `name sha256` per result on stdout:
estimates of the demo (seeds 1-3, real firmware in the twin) and of `make real`, decodes of the captures, and the rows of the first runs of
every study. Owns nothing. Digests depend on the machine's floating point: compare runs of one machine only.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from echostep_studies.frame.recordings import DATA
from places import ROOT, TWIN

STUDIES = ("girard2011", "echoes", "noplan", "floors", "legs", "storeys", "fischer2008", "feet")
WITHOUT_RUNS = ("echoes", "feet")
OPTIONS: dict[str, list[object]] = {"feet": ["--data", DATA], "storeys": ["--data", DATA], "noplan": ["--rows", "trail/*"]}  # fmt: skip
TIMING = re.compile(r"_ms$|_s_cpu$|core|latency|speed|real_time|pace")  # keys and metrics that are measured times


def run(*words: object) -> str:
    """Standard output of a command of this checkout; raises CalledProcessError with its stderr printed."""
    done = subprocess.run([str(word) for word in words], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(
            f"{' '.join(str(word) for word in words)}: exit {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-2000:]}"
        )
    return done.stdout


def echostep(*words: object) -> str:
    """Standard output of an echostep command of this checkout."""
    return run(sys.executable, "-m", "echostep", *words)


def sha256(text: str | bytes) -> str:
    """Hex digest of text (UTF-8) or bytes."""
    return hashlib.sha256(text.encode() if isinstance(text, str) else text).hexdigest()


def demo(out: Path) -> Iterator[tuple[str, str]]:
    """track.csv of three simulated walks through the real firmware."""
    if not Path(TWIN[0]).exists():
        print("demo: skipped, the twin is not built (make demo builds it)", file=sys.stderr)
        return
    for seed in (1, 2, 3):
        folder = out / f"demo{seed}"
        output = echostep(
            "demo", "--headless", "--no-page", "--seed", seed, "--out", folder, "--board-command", " ".join(TWIN)
        )
        yield f"demo/{seed}/estimates", output.split("sha256 ")[1].split()[0].rstrip(";")
        yield f"demo/{seed}/track", sha256((folder / "track.csv").read_bytes())


def real(out: Path) -> Iterator[tuple[str, str]]:
    """Estimates of the recorded foot on the plan drawn around its path."""
    output = run(sys.executable, "-m", "echostep_studies.figures.real_walk", "--out", out / "real")
    yield "real/estimates", output.split("sha256 ")[1].split()[0]


def captures() -> Iterator[tuple[str, str]]:
    """JSON lines of the captures that the tests ship."""
    for path in sorted((ROOT / "tests/captures").glob("*.bin")) + sorted((ROOT / "tests/captures").glob("*.mcap")):
        yield f"decode/{path.name}", sha256(echostep("decode", path))


def studies(out: Path, runs: int, chosen: list[str] | None) -> Iterator[tuple[str, str]]:
    """Rows of the first runs of every study, or of the chosen ones, without measured times."""
    for study in chosen or STUDIES:
        folder = out / study
        words = OPTIONS.get(study, []) + ([] if study in WITHOUT_RUNS else ["--runs", runs])
        echostep("evaluate", study, *words, "--out", folder, "--json", folder / "rows.json")
        rows = json.loads((folder / "rows.json").read_text())["rows"]
        recorded = [
            {k: v for k, v in row.items() if not TIMING.search(k)}
            for row in rows
            if not TIMING.search(str(row.get("metric")))
        ]
        for k, row in enumerate(recorded):
            yield (
                f"study/{study}/{k}",
                sha256(json.dumps(row, sort_keys=True))[:16] + " " + json.dumps(row, sort_keys=True),
            )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=5, help="runs of each study")
    parser.add_argument("--only", choices=("demo", "real", "captures", "studies"), action="append")
    parser.add_argument("--study", choices=STUDIES, action="append", help="only this study")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        parts: dict[str, Iterator[tuple[str, str]]] = {
            "captures": captures(),
            "demo": demo(out),
            "real": real(out),
            "studies": studies(out, options.runs, options.study),
        }
        for name, rows in parts.items():
            if options.only and name not in options.only:
                continue
            for row, digest in rows:
                print(row, digest, flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
