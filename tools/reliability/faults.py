# SPDX-License-Identifier: MIT
"""Each fault of the twin and of the host during one simulated walk: losses, time until the streams are complete again, and the tracker's claims.

In: the ELF and the twin. Out: one JSON line per fault in the output file, and their table on stdout; with `--page`, in host/docs/faults.md
too. Faults that the file has already are not run again. Owns the list of the twin's faults; those of the host are in twin/host_faults.py.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

from echostep.board.frames import BoardReader
from echostep.localization import Estimate
from echostep.plan import load_plan
from echostep.ports.chunks import MTX, Chunk
from echostep.tracker import Tracker
from echostep_app.session.chunk_streams import portions_of
from echostep_simulation.devices.board import Board, BoardProcess
from echostep_simulation.scenario import START_NS, Scenario, demo_scenario
from places import OUT, PLAN, ROOT, TWIN
from reliability.campaign import CampaignJournal, options
from reliability.fault_outcomes import NORMAL_S, FaultOutcome, columns, heard, judge_estimates, judge_streams, table
from twin.host_faults import HOST_FAULTS
from twin.live_walk import BEGIN_S, END_S, HostFault, LiveWalk

PAGE = ROOT / "host/docs/faults.md"
MARKS = "<!-- table -->\n", "<!-- end of table -->\n"
SEED = 1
LATE_S = 1.0  # of a walk in real time that still counts; assumed
PORTION = 50  # chunks that are tracked together


class TwinFault(NamedTuple):
    """Switches of the twin at BEGIN_S, and `seconds` later those that end it (none: it stays); meanwhile chunks of the ports in `lost` are lost."""

    switches: tuple[str, ...]
    end: tuple[str, ...] = ()
    seconds: float = 3.0
    lost: tuple[str, ...] = ()
    title: str = ""  # in the place of the switches

    @property
    def name(self) -> str:
        """The switches as text, with the duration."""
        return (self.title or ", ".join(self.switches) or "none") + (f" for {self.seconds:g} s" if self.end else "")


def _device_faults() -> Iterator[TwinFault]:
    for name, values in (
        ("srf_left", ("absent", "mute", "deaf")),
        ("srf_right", ("nack", "stretch")),
        ("compass", ("absent", "bad_value")),
        ("thigh", ("absent", "stuck")),
        ("calf", ("zeros", "wrong_channel")),
        ("scp1000", ("absent", "drdy_stuck", "no_eeprom")),
    ):
        for value in values:
            yield TwinFault((f"{name}={value}",), (f"{name}=ok",))


def _kit_faults() -> Iterator[TwinFault]:
    """Parts of the kit of 2026, and MaxSonars, that are plugged in instead of the papers' ones, and that then fail."""
    for part, papers in (("thigh=lsm6dso", "adis16100"), ("compass=lis3mdl", "cmps10"), ("pressure=bmp390", "scp1000")):
        yield TwinFault((f"part_{part}",), (f"part_{part.split('=')[0]}={papers}",))
    rangers = ("part_ranger_left", "part_ranger_right")
    back = tuple(f"{each}=srf02" for each in rangers)
    maxsonars = tuple(f"{each}=maxsonar" for each in rangers)
    yield TwinFault(tuple(f"{each}=pulse" for each in rangers), back)
    yield TwinFault(maxsonars, back)
    yield TwinFault((*maxsonars, "maxsonar_left=deaf"), ("maxsonar_left=ok", *back))
    for fault in ("pulse_left=deaf", "imu_thigh=absent", "bmp390=absent", "lis3mdl=nack"):
        yield TwinFault(("kit=2026", fault), (f"{fault.split('=')[0]}=ok", "kit=papers"))


FAULTS = (
    TwinFault(()),
    *_device_faults(),
    *_kit_faults(),
    *(TwinFault((f"srf_cycle={us}",)) for us in (66_000, 70_000)),
    TwinFault(("srf_window=60000", "fading=50")),
    *(
        TwinFault(("kit=2026", f"pulse_left={module}"), ("pulse_left=ok", "kit=papers"))
        for module in ("no_timeout", "ghost")
    ),
    *(TwinFault(("kit=2026", f"{way}_errors=30")) for way in ("spi", "mosi")),
    TwinFault(("sda=stuck",)),
    TwinFault(("sda=stuck_forever",), ("sda=ok",)),
    TwinFault(("scl=stuck",), ("scl=ok",)),
    TwinFault(("usb=reset",)),
    TwinFault(("usb=configure",)),
    TwinFault(("usb=suspend",), ("usb=resume",)),
    TwinFault(("suspend_repeats=on", "usb=suspend"), ("usb=resume", "suspend_repeats=off")),
    TwinFault(("usb=unplug",), ("usb=plug",)),
    TwinFault(("usb_errors=100",)),
    TwinFault(("host=stall",), ("host=read",)),
    TwinFault(("reset=watchdog",)),
    TwinFault(("cpu=hang_deaf",)),
    TwinFault(("reset=external",)),
    TwinFault(("bootloader=none", "reset=external")),
    TwinFault(("supply=4500",), ("supply=5000",)),
    TwinFault(("supply=3000",), ("supply=5000",), 0.3),
    TwinFault(("supply=2500",), ("supply=5000",), 0.3),
    TwinFault(("bootloader=none", "supply=2500"), ("supply=5000",), 0.3),
    TwinFault(("swapped=rangers",)),
    TwinFault(("swapped=thigh_calf",)),
    TwinFault(("crystal=drift",)),
    TwinFault(("crystal=resonator",)),
    TwinFault(("usb=suspend",), ("usb=resume",), 10.0, (MTX,), "the computer sleeps"),
)


def _with_fault(scenario: Scenario, board: Board, fault: TwinFault) -> Iterator[Chunk]:
    """The chunks of the walk up to END_S, the fault in it."""
    due = [(BEGIN_S, fault.switches), (BEGIN_S + fault.seconds, fault.end)]
    for chunk in scenario.chunks():
        t_s = walk_s(chunk.t_arrival_ns)
        while due and t_s >= due[0][0]:
            for switch in due.pop(0)[1]:
                board.fault(switch)
        if t_s > END_S:
            return
        if chunk.port not in fault.lost or not BEGIN_S <= t_s < BEGIN_S + fault.seconds:
            yield chunk


def walk_s(t_arrival_ns: int) -> float:
    """Seconds of the walk at an arrival time."""
    return (t_arrival_ns - START_NS) * 1e-9


def run(fault: TwinFault, board: Board | None = None) -> FaultOutcome:
    """One walk with this fault, as fast as it can be computed; with the real firmware unless another board is given."""
    plan = load_plan(PLAN)
    board = board or BoardProcess([*TWIN, "--seed", str(SEED)])
    scenario = demo_scenario(plan, SEED, board)
    tracker, reader = Tracker(plan, scenario.start, seed=SEED), BoardReader()
    times_s: dict[str, list[float]] = {name: [] for name in NORMAL_S}
    estimates: list[Estimate] = []
    try:
        chunks = heard(_with_fault(scenario, board, fault), reader, times_s, walk_s)
        for portion in portions_of(chunks, PORTION):
            estimates += tracker.take(portion)
    finally:
        scenario.close()
    outcome = FaultOutcome(fault.name, reader.counts.lost + reader.counts.rejected)
    judge_streams(outcome, times_s, BEGIN_S, END_S)
    judged = [e for e in estimates if e.t_s >= BEGIN_S]
    judge_estimates(outcome, *columns(judged), scenario.truth)
    return outcome


def matrix(folder: Path) -> Mapping[str, Callable[[], FaultOutcome]]:
    """Each fault by name, and the function that runs it; live runs keep their files in `folder`."""
    simulated = {fault.name: partial(run, fault) for fault in FAULTS}
    return simulated | {fault.title: partial(run_live, fault, folder) for fault in HOST_FAULTS}


def run_live(fault: HostFault, folder: Path) -> FaultOutcome:
    """One walk with a fault of the host, in real time, through `echostep live` on the twin's ports; ends the program when that was too slow."""
    with LiveWalk(folder / fault.slug, fault) as walk:
        outcome = walk.play()
    if walk.late_s > LATE_S:
        raise SystemExit(
            f"{fault.title}: the walk fell {walk.late_s:.1f} s behind: this computer is too busy to measure"
        )
    return outcome


def main() -> int:
    asked = options(
        __doc__,
        out=(OUT / "faults.jsonl", "outcomes so far; they are not run again"),
        page=(False, "write the table into host/docs/faults.md"),
    )
    runs = matrix(asked.out.with_suffix(""))
    rows = CampaignJournal(asked.out).play("faults", runs, lambda row: table([FaultOutcome(**row)]).splitlines()[-1])
    done = [FaultOutcome(**row) for row in rows]
    if asked.page:
        head, _, rest = PAGE.read_text().partition(MARKS[0])
        PAGE.write_text(head + MARKS[0] + table(done) + MARKS[1] + rest.partition(MARKS[1])[2])
    print(table(done))
    return int(any(outcome.wrongly_sure for outcome in done))


if __name__ == "__main__":
    sys.exit(main())
