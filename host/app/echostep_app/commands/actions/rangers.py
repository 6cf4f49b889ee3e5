# SPDX-License-Identifier: MIT
"""`echostep calibrate rangers`, and `[ranger] learn` after a live walk: the wearer's own two rangers from a walk on a plan, recorded before or now.

In: a recording or ports, a plan, a settings file. Out: findings and figures, settings. Owns the instructions and the order: track, judge, write.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

from rich.console import Console

from echostep.echoes.rangers import echo_of
from echostep.errors import EchostepError
from echostep.file_mode import claim
from echostep.recording import open_parts, open_recording
from echostep.settings import parse_settings
from echostep.tracker import Tracker
from echostep_app.commissioning.calibrate import Sections, read_sections, write_sections
from echostep_app.commissioning.rangers.faults import LEAST_GAIN, SWAPPED, explained
from echostep_app.commissioning.rangers.poses import PosedPings, SwappedTracker, posed_pings
from echostep_app.commissioning.rangers.report import RangerReport, report
from echostep_app.printing.lines import as_error
from echostep_app.recording.names import files_of
from echostep_app.session.metadata import plan_of
from echostep_app.session.options import PortOptions, TrackingOptions
from echostep_app.session.runs.live import record
from echostep_app.session.runs.replay import tracker_of

SURELY = 0.9  # share of the pings sent while `tracking`: of rangers that are swapped a search may find a place that looks alike; assumed
NOTHING = "Nothing was written: mend it, and walk again."
GUIDED_S = 60.0  # 400 pings of each ranger
GUIDE = (
    "Rangers: begin at the start that is marked on the plan and walk for a minute: along a wall, once round on the spot in a corner, "
    "stand for five seconds at an open door, and back along the other wall."
)
PLAN_NEEDED = "calibrate rangers: --plan is needed, that of the building where the wearer walks, with a marked start"


def walk_now(ports: PortOptions, folder: Path, console: Console) -> Path:
    """Record a minute during which the wearer walks as asked."""
    console.print(GUIDE)
    return record(ports, folder / "rangers.mcap")


def calibrate_rangers(paths: list[Path], tracking: TrackingOptions, out: Path, console: Console) -> None:
    """Judge and fit the rangers of a walk; raises EchostepError where the walk cannot be used, or a ranger has a fault."""
    tracker, pings = tracked(paths, tracking)
    if _fit_better_swapped(paths, tracker, pings):
        raise EchostepError(f"{SWAPPED} {NOTHING}")
    found = report_of(tracker, pings)
    for line in found.lines:
        console.print(line)
    if found.faults:
        raise EchostepError("\n".join([*found.faults, NOTHING]))
    if not found.values:
        return
    write_sections(out, merged(read_sections(out), found))
    console.print(f"{out}: use it with --settings {out}")


def tracked(paths: list[Path], tracking: TrackingOptions) -> tuple[Tracker, PosedPings]:
    """A tracker that has taken a walk, and the walk's pings at the places where it believed them to be sent."""
    recording = open_parts(paths)
    tracker = tracker_of(recording, plan_of(tracking), tracking)
    return tracker, posed_pings(tracker, recording.portions())


def report_of(tracker: Tracker, pings: PosedPings) -> RangerReport:
    """Faults, or fitted settings, beside those of the walk."""
    usual = echo_of(pings.part, tracker.settings.echo)
    return report(pings, tracker.laid_out.walls, usual, tracker.settings.ranger)


def merged(sections: Sections, found: RangerReport) -> Sections:
    """Settings with what was fitted."""
    return sections | {name: sections.get(name, {}) | values for name, values in found.values.items()}


def _fit_better_swapped(paths: list[Path], tracker: Tracker, pings: PosedPings) -> bool:
    """Whether the plan explains a walk surely better if each ranger's pings are the other one's."""
    other = SwappedTracker(tracker.plan, tracker.start, tracker.settings)
    swapped = posed_pings(other, open_parts(paths).portions())
    if swapped.believed < SURELY:
        return False
    walls, usual = tracker.laid_out.walls, tracker.settings.echo
    return pings.believed < SURELY or explained(swapped, walls, usual) > explained(pings, walls, usual) + LEAST_GAIN


ENDING = "-rangers.toml"  # of the file, after the recording's name
UNLEARNED = "Rangers: nothing was learned"


def learn_rangers(recording: Path, tracking: TrackingOptions, console: Console) -> None:
    """Where the walk's settings ask for it, write what it tells of the rangers, and say in a sentence what differs, or why nothing was learned.

    `recording`: the last part of it.
    """
    try:
        text = open_recording(recording).metadata.get("settings_toml", "")
    except EchostepError:  # no byte came, which the run has said
        return
    if not parse_settings(text, str(recording)).ranger.learn:
        return
    try:
        words = _learned(recording, TrackingOptions(tracking.plan_path), tomllib.loads(text))
    except EchostepError as error:
        words = f"{UNLEARNED}: {error}"
    except KeyboardInterrupt:
        words = f"{UNLEARNED}: interrupted; echostep calibrate rangers {recording} --plan PLAN does it later"
    console.print(words, markup=False, highlight=False)


def _learned(recording: Path, on_plan: TrackingOptions, sections: Sections) -> str:
    """Track the walk again, fit, write; the sentence about it."""
    if not plan_of(on_plan).is_drawn:
        return f"{UNLEARNED}: without a plan no echo has a known distance"
    files = files_of(recording)
    tracker, pings = tracked(files, on_plan)
    if pings.believed < SURELY:
        return f"{UNLEARNED}: the place was doubted for {100.0 * (1.0 - pings.believed):.0f} % of the pings"
    found = report_of(tracker, pings)
    if not found.values:
        return f"{UNLEARNED}: {' '.join(found.faults or found.lines[-1:])}"
    name = files[0].stem
    out = recording.with_name(f"{name}{ENDING}")
    with as_error(f"{out}: cannot write the settings"):
        claim(out)
    write_sections(out, merged(sections, found), [f"From {name}.", *found.lines])
    return f"Rangers learned from this walk: {_changes(tracker, pings.part, found)}; use them with --settings {out}"


def _changes(tracker: Tracker, part: int, found: RangerReport) -> str:
    """Each fitted value beside the one that the walk had."""
    settings = tracker.settings
    before = {"echo": echo_of(part, settings.echo), "ranger": settings.ranger}
    return ", ".join(
        f"{name} {value:.3g} ({getattr(before[section], name):.3g})"
        for section, values in found.values.items()
        for name, value in values.items()
    )
