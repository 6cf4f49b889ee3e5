# SPDX-License-Identifier: MIT
"""Each fault of the twin during one simulated walk: what was lost, how long until the streams were whole, what the tracker claimed meanwhile.

In: the ELF and the twin. Out: one JSON line per fault in the output file, and their table on stdout; with `--page`, in host/docs/faults.md
too. Faults that the file has already are not run again. Owns the list of faults.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from echostep.board import messages as m
from echostep.board.frames import BoardReader
from echostep.localization.estimate import Estimate, TrackStatus
from echostep.plan.model import load_plan
from echostep.ports.chunks import BOARD, Chunk
from echostep.session.chunk_streams import portions_of
from echostep.simulation.devices.board import BoardProcess
from echostep.simulation.scenario import START_NS, Scenario, demo_scenario
from echostep.tracker import Tracker

ROOT = Path(__file__).resolve().parent.parent
TWIN = [str(ROOT / "tools/twin/build/echostep-twin"), "--elf", str(ROOT / "firmware/build/echostep.elf")]
PAGE = ROOT / "host/docs/faults.md"
MARKS = "<!-- table -->\n", "<!-- end of table -->\n"
SEED = 1
PORTION = 50  # chunks that are tracked together
# Of the walk: the fault begins while the wearer walks in a corridor; the last second that is judged.
BEGIN_S, END_S = 20.0, 50.0
SURE_M = 1.0  # an estimate with the status `tracking` claims to be within it


class Fault(NamedTuple):
    """Switches of the twin at BEGIN_S, and `seconds` later those that end it (none: it stays)."""

    switches: tuple[str, ...]
    end: tuple[str, ...] = ()
    seconds: float = 3.0

    @property
    def name(self) -> str:
        """The switches as text, with the duration."""
        return ", ".join(self.switches) + (f" for {self.seconds:g} s" if self.end else "")


def _device_faults() -> Iterator[Fault]:
    for name, values in (
        ("srf_left", ("absent", "mute", "deaf")),
        ("srf_right", ("nack", "stretch")),
        ("compass", ("absent", "bad_value")),
        ("thigh", ("absent", "stuck")),
        ("calf", ("zeros", "wrong_channel")),
        ("scp1000", ("absent", "drdy_stuck", "no_eeprom")),
    ):
        for value in values:
            yield Fault((f"{name}={value}",), (f"{name}=ok",))


FAULTS = (
    Fault(()),
    *_device_faults(),
    Fault(("sda=stuck",)),
    Fault(("sda=stuck_forever",), ("sda=ok",)),
    Fault(("scl=stuck",), ("scl=ok",)),
    Fault(("usb=reset",)),
    Fault(("usb=configure",)),
    Fault(("usb=suspend",), ("usb=resume",)),
    Fault(("usb=unplug",), ("usb=plug",)),
    Fault(("usb_errors=100",)),
    Fault(("host=stall",), ("host=read",)),
    Fault(("reset=watchdog",)),
    Fault(("cpu=hang_deaf",)),
    Fault(("reset=external",)),
    Fault(("bootloader=none", "reset=external")),
    Fault(("supply=4500",), ("supply=5000",)),
    Fault(("supply=3000",), ("supply=5000",), 0.3),
    Fault(("supply=2500",), ("supply=5000",), 0.3),
    Fault(("bootloader=none", "supply=2500"), ("supply=5000",), 0.3),
    Fault(("swapped=rangers",)),
    Fault(("swapped=thigh_calf",)),
    Fault(("crystal=drift",)),
    Fault(("crystal=resonator",)),
)


class Stream(NamedTuple):
    """A measurement, and the longest time between two valid ones that is normal."""

    is_valid: Callable[[m.Message], bool]
    normal_s: float


def _ping(ranger: m.Ranger) -> Stream:
    return Stream(lambda x: isinstance(x, m.Ping) and x.ranger == ranger and x.outcome != m.Outcome.BUS_ERROR, 0.25)


def _gyro(name: str) -> Stream:
    return Stream(lambda x: isinstance(x, m.Gyros) and getattr(x, name) != m.GYROS_INVALID, 0.05)


STREAMS = {
    "left": _ping(m.Ranger.LEFT),
    "right": _ping(m.Ranger.RIGHT),
    "thigh": _gyro("thigh"),
    "calf": _gyro("calf"),
    "belt": _gyro("belt"),
    "pressure": Stream(lambda x: isinstance(x, m.Pressure) and x.pressure != m.PRESSURE_PRESSURE_INVALID, 0.4),
    "compass": Stream(lambda x: isinstance(x, m.Compass) and x.bearing != m.COMPASS_BEARING_INVALID, 0.35),
    "sync": Stream(lambda x: isinstance(x, m.Sync), 0.06),
}


@dataclass
class Outcome:
    """What a fault did. `silent_s`: by stream, time in too wide gaps. `whole_s`: from the begin to the end of the last gap; None: never."""

    name: str
    lost_frames: int = 0
    silent_s: dict[str, float] = field(default_factory=dict)
    whole_s: float | None = 0.0
    tracking: float = 0.0  # share of the estimates after the begin
    worst_tracking_m: float = 0.0
    wrongly_sure: int = 0  # estimates that were `tracking` and more than SURE_M off
    worst_m: float = 0.0


def _with_fault(scenario: Scenario, board: BoardProcess, fault: Fault) -> Iterator[Chunk]:
    """The chunks of the walk up to END_S, the fault in it."""
    due = [(BEGIN_S, fault.switches), (BEGIN_S + fault.seconds, fault.end)]
    for chunk in scenario.chunks():
        t_s = (chunk.t_arrival_ns - START_NS) * 1e-9
        while due and t_s >= due[0][0]:
            for switch in due.pop(0)[1]:
                board.fault(switch)
        if t_s > END_S:
            return
        yield chunk


def _heard(chunks: Iterator[Chunk], reader: BoardReader, times_s: dict[str, list[float]]) -> Iterator[Chunk]:
    """The same chunks; the arrival times of valid measurements after BEGIN_S go into `times_s`."""
    for chunk in chunks:
        t_s = (chunk.t_arrival_ns - START_NS) * 1e-9
        for message in reader.feed(chunk.data) if chunk.port == BOARD else ():
            for name, stream in STREAMS.items():
                if t_s >= BEGIN_S and stream.is_valid(message):
                    times_s[name].append(t_s)
        yield chunk


def run(fault: Fault) -> Outcome:
    """One walk with this fault."""
    plan = load_plan(ROOT / "host/echostep/plans/demo.json")
    board = BoardProcess([*TWIN, "--seed", str(SEED)])
    scenario = demo_scenario(plan, SEED, board)
    tracker, reader = Tracker(plan, scenario.start, seed=SEED), BoardReader()
    times_s: dict[str, list[float]] = {name: [BEGIN_S] for name in STREAMS}
    estimates: list[Estimate] = []
    try:
        for portion in portions_of(_heard(_with_fault(scenario, board, fault), reader, times_s), PORTION):
            estimates += tracker.take(portion)
    finally:
        scenario.close()
    outcome = Outcome(fault.name or "none", reader.counts.lost + reader.counts.rejected)
    _judge_streams(outcome, times_s)
    _judge_estimates(outcome, [e for e in estimates if e.t_s >= BEGIN_S], scenario)
    return outcome


def _judge_streams(outcome: Outcome, times_s: dict[str, list[float]]) -> None:
    for name, stream in STREAMS.items():
        arrived = np.array([*times_s[name], END_S])
        gaps = np.diff(arrived)
        wide = gaps > stream.normal_s
        if not wide.any():
            continue
        outcome.silent_s[name] = float(gaps[wide].sum())
        whole_s = None if wide[-1] else float(arrived[1:][wide][-1]) - BEGIN_S
        if outcome.whole_s is not None:
            outcome.whole_s = None if whole_s is None else max(outcome.whole_s, whole_s)


def _judge_estimates(outcome: Outcome, estimates: list[Estimate], scenario: Scenario) -> None:
    truth = scenario.truth
    t_s = np.array([e.t_s for e in estimates])
    true_m = np.column_stack([np.interp(t_s, truth[:, 0], truth[:, k]) for k in (1, 2)])
    off_m = np.hypot(*(np.array([(e.x_m, e.y_m) for e in estimates]) - true_m).T)
    sure = np.array([e.status is TrackStatus.TRACKING for e in estimates])
    outcome.tracking = float(sure.mean())
    outcome.worst_tracking_m = float(off_m[sure].max(initial=0.0))
    outcome.wrongly_sure = int((off_m[sure] > SURE_M).sum())
    outcome.worst_m = float(off_m.max())


def _silent(outcome: Outcome) -> str:
    """What was missing, streams of equal time together."""
    groups: dict[str, list[str]] = {}
    for name, seconds in outcome.silent_s.items():
        groups.setdefault(f"{seconds:.1f} s", []).append(name)
    if len(groups) == 1 and len(outcome.silent_s) == len(STREAMS):
        return f"all {next(iter(groups))}"
    return "; ".join(f"{', '.join(names)} {seconds}" for seconds, names in groups.items()) or "nothing"


def table(outcomes: list[Outcome]) -> str:
    """The outcomes as a Markdown table."""
    lines = [
        "| fault | frames lost | silent | whole after | share of `tracking` | worst while `tracking` "
        f"| `tracking` and more than {SURE_M:g} m off | worst |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for o in outcomes:
        whole = "never" if o.whole_s is None else f"{o.whole_s:.1f} s"
        name = ", ".join(f"`{part}`" if "=" in part else part for part in o.name.split(", "))
        lines.append(
            f"| {name} | {o.lost_frames} | {_silent(o)} | {whole} | {100 * o.tracking:.0f} % "
            f"| {o.worst_tracking_m:.2f} m | {o.wrongly_sure} | {o.worst_m:.2f} m |"
        )
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument(
        "--out", type=Path, default=ROOT / "out/faults.jsonl", help="outcomes so far; they are not run again"
    )
    parser.add_argument("--page", action="store_true", help="write the table into host/docs/faults.md")
    options = parser.parse_args()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    done = (
        [Outcome(**json.loads(line)) for line in options.out.read_text().splitlines()] if options.out.exists() else []
    )
    for fault in FAULTS:
        if (fault.name or "none") in {outcome.name for outcome in done}:
            continue
        done.append(run(fault))
        with options.out.open("a") as file:
            file.write(json.dumps(asdict(done[-1])) + "\n")
        print(table(done[-1:]).splitlines()[-1], flush=True)
    names = [fault.name or "none" for fault in FAULTS]
    done = sorted((o for o in done if o.name in names), key=lambda o: names.index(o.name))
    if options.page:
        head, _, rest = PAGE.read_text().partition(MARKS[0])
        PAGE.write_text(head + MARKS[0] + table(done) + MARKS[1] + rest.partition(MARKS[1])[2])
    print(table(done))
    return int(any(outcome.wrongly_sure for outcome in done))


if __name__ == "__main__":
    sys.exit(main())
