# SPDX-License-Identifier: MIT
"""CPU time of each stage of a replay: the smallest of several rounds.

In: a recording and its plan. Out: a table on the terminal. Kernels are compiled before the measurement.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from echostep.plan import load_plan
from echostep.recording import open_recording
from echostep.tracker import Tracker

Spent = dict[str, float]


def timed(stage: str, work: Callable[..., Any], spent: Spent) -> Callable[..., Any]:
    """The same function; its CPU time is added to `spent[stage]`."""

    def run(*arguments: Any) -> Any:
        began = time.thread_time()
        result = work(*arguments)
        spent[stage] = spent.get(stage, 0.0) + time.thread_time() - began
        return result

    return run


def replay(path: Path, plan_path: Path) -> tuple[Spent, float]:
    """CPU seconds of each stage, and the time span of the estimates (s)."""
    tracker, spent = Tracker(load_plan(plan_path)), Spent()
    tracker.warm_up()
    recording, front_end = open_recording(path), tracker.front_end
    for stage, owner, name in (
        ("board frames", front_end.board, "frames"),
        ("foot samples", front_end.foot_source, "read"),
        ("timeline", front_end.timeline, "times"),
        ("foot and path", front_end, "_track_foot"),
        ("all of the front end", front_end, "process"),
    ):
        setattr(owner, name, timed(stage, getattr(owner, name), spent))
    began = time.thread_time()
    estimates = [e for portion in recording.portions() for e in tracker.take(portion)]
    spent["replay"] = time.thread_time() - began
    return spent, estimates[-1].t_s - estimates[0].t_s


def reading_time(path: Path) -> float:
    """CPU seconds to read the recording without tracking."""
    recording, began = open_recording(path), time.thread_time()
    for _ in recording.portions():
        pass
    return time.thread_time() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("recording", type=Path)
    parser.add_argument("--plan", type=Path, default=Path("host/core/echostep/plans/demo.json"))
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    runs = [replay(options.recording, options.plan) for _ in range(options.rounds)]
    least = {stage: min(spent[stage] for spent, _ in runs) for stage in runs[0][0]}
    read_s, span_s = min(reading_time(options.recording) for _ in range(options.rounds)), runs[0][1]
    inner = ("board frames", "foot samples", "timeline", "foot and path")
    rows = {"reading the recording": read_s} | {stage: least[stage] for stage in inner}
    rows["ports, pings, waiting"] = least["all of the front end"] - sum(least[stage] for stage in inner)
    rows["bytes to legs and pings"] = read_s + least["all of the front end"]
    rows["cloud and estimates"] = least["replay"] - rows["bytes to legs and pings"]
    rows["replay"] = least["replay"]
    table = Table(
        "stage", "ms", "x real time", title=f"{options.recording}: {span_s:.0f} s of walk, least of {options.rounds}"
    )
    for stage, seconds in rows.items():
        table.add_row(stage, f"{1e3 * seconds:.1f}", f"{span_s / seconds:.0f}", end_section=stage == inner[-1])
    Console().print(table)


if __name__ == "__main__":
    main()
