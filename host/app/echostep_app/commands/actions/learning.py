# SPDX-License-Identifier: MIT
"""`[ranger] learn`: what a live walk tells of its rangers is kept beside its recording, as settings that may be used for the next walk.

In: the recording of a walk that is over, the options of its tracking. Out: a settings file, and a sentence. Owns its name. The walk's own settings
file is not changed. The values are those of `echostep calibrate rangers` by the same recording.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

from rich.console import Console

from echostep.errors import EchostepError
from echostep.file_mode import claim
from echostep.localization import echo_of
from echostep.recording import open_recording
from echostep.settings import parse_settings
from echostep.tracker import Tracker
from echostep_app.commands.actions.rangers import SURELY, merged, report_of, tracked
from echostep_app.commissioning.calibrate import Sections, write_sections
from echostep_app.commissioning.rangers.report import RangerReport
from echostep_app.printing.lines import as_error
from echostep_app.recording.names import files_of
from echostep_app.session.metadata import plan_of
from echostep_app.session.options import TrackingOptions

ENDING = "-rangers.toml"  # of the file, after the recording's name
NOTHING = "Rangers: nothing was learned"


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
        words = f"{NOTHING}: {error}"
    except KeyboardInterrupt:
        words = f"{NOTHING}: interrupted; echostep calibrate rangers {recording} --plan PLAN does it later"
    console.print(words, markup=False, highlight=False)


def _learned(recording: Path, on_plan: TrackingOptions, sections: Sections) -> str:
    """Track the walk again, fit, write; the sentence about it."""
    if not plan_of(on_plan).is_drawn:
        return f"{NOTHING}: without a plan no echo has a known distance"
    files = files_of(recording)
    tracker, pings = tracked(files, on_plan)
    if pings.believed < SURELY:
        return f"{NOTHING}: the place was doubted for {100.0 * (1.0 - pings.believed):.0f} % of the pings"
    found = report_of(tracker, pings)
    if not found.values:
        return f"{NOTHING}: {' '.join(found.faults or found.lines[-1:])}"
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
