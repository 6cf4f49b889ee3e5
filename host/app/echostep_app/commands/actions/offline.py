# SPDX-License-Identifier: MIT
"""`echostep import`, `foot`, `legs`, `floors` and `decode`: recorded files of single sensors, without a plan.

In: files of a foot IMU, of leg gyros or of a barometer, captured bytes. Out: track files and a summary; JSON lines. Owns nothing.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import TypeVar

from echostep.errors import EchostepError
from echostep.legs.stride import StrideSettings
from echostep.offline.imu_csv import Imu, describe_track, own_track, write_foot_track
from echostep.recording import Decoder, as_json, read_capture
from echostep.xsens.message import MessageReader
from echostep.xsens.output_formats import OutputFormats
from echostep_app.kernel_parts import FOOT, PREPARING, compile_parts
from echostep_app.offline.floors.floor_table import describe, find_levels, parse_heights, write_floors
from echostep_app.offline.floors.floors import record_floors
from echostep_app.offline.floors.pressure_csv import load_pressures
from echostep_app.offline.floors.stays import height_record
from echostep_app.offline.foot_files import load_foot, refuse_glide
from echostep_app.offline.foreign_columns import OWN, Naming
from echostep_app.offline.importing import Beside, import_imu
from echostep_app.offline.leg_csv import load_pair
from echostep_app.offline.leg_pair import track_pair
from echostep_app.offline.leg_track import (
    calibrated_scale,
    checked_lengths,
    describe_legs,
    describe_strides,
    track_default,
    write_leg_track,
)
from echostep_app.output.offline_plots import draw_floors, draw_foot, draw_legs
from echostep_app.printing.console import console
from echostep_app.printing.lines import complain
from echostep_app.printing.people import is_unread
from echostep_app.printing.progress import progress_line
from echostep_app.recording.capture_summary import summary
from echostep_app.recording.names import link_newest, new_name
from echostep_app.scorecard.truth import load_truth, truth_field
from echostep_app.session.metadata import check_start, plan_of, run_metadata, start_given, version_metadata
from echostep_app.session.options import OutputOptions, TrackingOptions
from echostep_app.session.results import output_folder
from echostep_app.session.runs.replay import replay

Method = TypeVar("Method")
DEFAULT = "default"  # the method of this project
GROUP = "echostep.profiles"  # entry points of other methods: those of the papers are in echostep-studies
SCALE_RANGE = (0.5, 2.0)  # of --scale: beyond it the lengths of the leg are wrong


def import_foot(
    path: Path, out: Path, naming: Naming = OWN, beside: Beside | None = None, truth: Path | None = None,
    about: dict[str, str] | None = None,
) -> None:  # fmt: skip
    """Make a recording of a foot IMU's file, with the true path in it where there is one; `about`: its other metadata."""
    imu, about = _told(path, naming), about or version_metadata()
    if truth is not None:
        field, words = truth_field(load_truth(truth, None), imu.t_s, path.name)
        about |= field
        console.print(words, markup=False)
    console.print(f"{path.name}: {import_imu(imu, path.name, out, about, beside or Beside())}", markup=False)
    console.print(f"recording: {out}", markup=False)


def foot_on_plan(
    path: Path, folder: Path, plan: Path, start: str | None, truth: Path | None, naming: Naming = OWN
) -> None:
    """Track a foot IMU's file on a plan: the recording and its results go into the folder. A wrong plan or start leaves none."""
    tracking = TrackingOptions(plan, start)
    on = plan_of(tracking)
    given = start_given(tracking, on)
    check_start(on, given, given=True)
    begun = given or on.start
    output_folder(folder)
    wanted = folder / f"{path.stem}.mcap"
    recording = new_name(wanted)
    import_foot(path, recording, naming, truth=truth, about=run_metadata(on, begun, 0, "") if begun else None)
    link_newest(recording, wanted)
    replay([recording], tracking, None, OutputOptions(folder, terminal=False), on)


def _told(path: Path, naming: Naming) -> Imu:
    """The samples of a foot IMU's file; repairs are printed."""
    imu = load_foot(path, naming)
    for note in imu.notes:
        console.print(f"{path.name}: {note}")
    return imu


def foot(path: Path, out: Path, profile: str, picture: Path | None, naming: Naming = OWN) -> None:
    """Track a recorded foot IMU with this project's method or a paper's."""
    track_recording = method("foot", profile, own_track)
    imu = _told(path, naming)
    with progress_line(PREPARING.capitalize()) as show:
        compile_parts([FOOT], show)
    track = track_recording(imu, path.name)
    refuse_glide(imu, track, path.name)
    write_foot_track(out, track)
    console.print(f"{path.name}: {describe_track(track)}")
    if picture is not None:
        draw_foot(picture, track, path.name)
    _tell_files(out, picture)


def _tell_files(out: Path, picture: Path | None) -> None:
    """Where the results went."""
    console.print(f"track: {out}" + (f", picture: {picture}" if picture else ""), markup=False)


@dataclass(frozen=True, slots=True)
class LegOptions:
    """Lengths of the leg (hip to knee, knee to ankle or floor), the wearer's stride scale, and the true length of the walk; None if not known."""

    thigh_m: float | None
    shank_m: float | None
    profile: str = DEFAULT
    scale: float | None = None
    walked_m: float | None = None


def legs(paths: list[Path], out: Path, options: LegOptions, picture: Path | None = None, naming: Naming = OWN) -> None:
    """Track a recorded leg, or both of one person, with this project's method or a paper's."""
    profile, scale = options.profile, options.scale
    track_leg = method("legs", profile, track_default)
    if scale is not None and not SCALE_RANGE[0] < scale < SCALE_RANGE[1]:
        raise EchostepError(f"--scale {scale:g}: expected about 1, as --walked prints it")
    lengths = checked_lengths(options.thigh_m, options.shank_m, scale or 1.0)
    path, pair = paths[0], load_pair(paths, naming)
    for note in (note for leg in pair for note in leg.notes):
        console.print(f"{path.name}: {note}")
    if lengths.measured_to_floor and profile == DEFAULT:
        ankle = f"{lengths.to_ankle_m:.3f} m to the ankle"
        console.print(f"--shank {lengths.shank_m:g} is taken as knee to floor: {ankle}")
    settings = StrideSettings(lengths, calibrated=scale is not None)
    if len(pair) == 2 and profile != DEFAULT:
        raise EchostepError(f"--profile {profile} is a method for one leg: give one file, without columns other_...")
    track = track_pair(*pair, settings) if len(pair) == 2 else track_leg(pair[0], settings)
    write_leg_track(out, track)
    for line in describe_strides(track):
        console.print(line)
    console.print(f"{path.name}: {describe_legs(track)}")
    if picture is not None:
        draw_legs(picture, track.rows, track.strides, path.name)
    _tell_files(out, picture)
    if options.walked_m is not None:
        factor = calibrated_scale(track.distance_m, options.walked_m)
        console.print(f"--scale {(scale or 1.0) * factor:.4f} makes this walk {options.walked_m:g} m long")


def floors(
    path: Path, heights: str, out: Path, start: int | None, picture: Path | None = None, naming: Naming = OWN
) -> None:
    """Write the floors of a recorded barometer and print the stays; raises EchostepError for options or samples that cannot be used."""
    given_m = None if heights.strip().lower() == "auto" else parse_heights(heights)
    if start is not None and given_m is None:
        raise EchostepError("--start is an index into --heights: with --heights auto there are none yet")
    if start is not None and given_m is not None and not 0 <= start < len(given_m):
        raise EchostepError(f"--start {start}: the floors of --heights are 0 to {len(given_m) - 1}")
    record = load_pressures(path, naming)
    for note in record.notes:
        console.print(f"{path}: {note}", markup=False)
    above = height_record(record.samples)
    if given_m is None:
        given_m = find_levels(above, path.name)
        console.print("floors found: --heights " + ",".join(f"{height:g}" for height in given_m))
    found = record_floors(record.samples.t_s, above, given_m, start)
    write_floors(out, found)
    console.print(describe(found, above), markup=False)
    if picture is not None:
        draw_floors(picture, found, path.name)
    console.print(f"floors: {out}" + (f", picture: {picture}" if picture else ""), markup=False)


def decode(path: Path, mode: str | None = None, settings: str | None = None) -> None:
    """Print a capture as JSON lines, and its contents in sentences on stderr. `mode`, `settings`: of legacy data, where they are known."""
    formats = OutputFormats(_bits("--output-mode", mode, 0xFFFF), _bits("--output-settings", settings, 0xFFFF_FFFF))
    decoder = Decoder(mt=MessageReader(formats))
    for message in read_capture(path, decoder):
        sys.stdout.write(json.dumps(as_json(message), allow_nan=False) + "\n")
        if is_unread():
            return
    for line in summary(decoder):
        complain(line)


def _bits(option: str, text: str | None, most: int) -> int | None:
    """The number of an option, as 6 or 0x0006; None without it."""
    if text is None:
        return None
    try:
        value = int(text, 0)
    except ValueError:
        value = -1
    if not 0 <= value <= most:
        raise EchostepError(f"{option} {text}: a number up to 0x{most:X} is expected, as 0x0006")
    return value


def method(part: str, name: str, own: Method) -> Method:
    """The method of a profile for a part, `foot` or `legs`; a profile has the signature of `own`. Raises EchostepError."""
    if name == DEFAULT:
        return own
    methods = {entry.name: entry for entry in entry_points(group=GROUP)}
    if f"{part}.{name}" in methods:
        loaded: Method = methods[f"{part}.{name}"].load()
        return loaded
    known = [DEFAULT, *sorted(entry.removeprefix(f"{part}.") for entry in methods if entry.startswith(f"{part}."))]
    more = "" if methods else "; those of the papers come with: pip install echostep-studies"
    raise EchostepError(f"--profile {name}: {part} has no such profile; it has {', '.join(known)}{more}")
