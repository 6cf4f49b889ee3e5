# SPDX-License-Identifier: MIT
"""`make faults`: its list of faults exists in the twin, its judgement of gaps, its table."""

from __future__ import annotations

import re

import faults
from board_runs import ROOT, Bench, needs_twin


@needs_twin
def test_every_fault_of_the_matrix_exists() -> None:
    bench = Bench()
    try:
        for fault in faults.FAULTS:
            for switch in (*fault.switches, *fault.end):
                bench.fault(switch)
        bench.run(1)
    finally:
        bench.board.close()


def test_the_matrix_has_a_fault_of_each_switch() -> None:
    names = re.findall(r"^\| (`[a-z_0-9`, ]+`) \| .* \|$", (ROOT / "tools/twin/README.md").read_text(), flags=re.M)
    known = {name for group in names for name in re.findall(r"`(\w+)`", group)}
    used = {switch.split("=")[0] for fault in faults.FAULTS for switch in fault.switches}
    assert used <= known
    assert known - used <= {
        "belt",
        "reset",
        "brown_out_fuse",
        "usb",
    }  # thigh and calf are like it; without an effect alone


def test_gaps_are_judged() -> None:
    begin_s, end_s = faults.BEGIN_S, faults.END_S
    regular = [begin_s + 0.1 * k for k in range(round(10 * (end_s - begin_s)))]
    times_s = {name: [t for t in regular if not begin_s + 2.0 < t < begin_s + 5.0] for name in faults.STREAMS}
    outcome = faults.Outcome("x=y")
    faults._judge_streams(outcome, times_s | dict.fromkeys(("thigh", "calf", "belt", "sync"), _dense(begin_s, end_s)))
    assert set(outcome.silent_s) == {"left", "right", "pressure", "compass"}
    assert outcome.whole_s is not None
    assert abs(outcome.whole_s - 5.0) < 0.11
    faults._judge_streams(outcome, {name: [begin_s] for name in faults.STREAMS})
    assert outcome.whole_s is None
    assert "| `x=y` | 0 | all 30.0 s | never |" in faults.table([outcome])


def _dense(begin_s: float, end_s: float) -> list[float]:
    return [begin_s + 0.02 * k for k in range(round(50 * (end_s - begin_s)))]
