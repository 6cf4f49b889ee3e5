# SPDX-License-Identifier: MIT
"""The command line: all of it if `echostep-app` is installed, else `decode`, `foot` and `replay --headless`.

In: the command's arguments. Out: JSON lines, tracks as CSV, an exit status (0: done; 2: a mistake, named in one line). Owns nothing. These
commands print and write the same lines and files as the whole command line.
"""

from __future__ import annotations

import argparse
import atexit
import gc
import json
import os
import sys
from importlib.metadata import version
from pathlib import Path

from echostep.additions import added
from echostep.errors import EchostepError, words_of
from echostep.kernel_cache import on_compiling

WHOLE = "pages, teams, live runs, plans of other formats and the other commands: pip install 'echostep[app]'"


def main() -> None:
    """Entry point."""
    # New objects. All that is imported stays: to look for garbage in it after each 700 took a tenth of a replay, to take it apart at the end a fifth.
    gc.set_threshold(50_000)
    atexit.register(gc.freeze)
    if whole := added("commands"):
        whole()
        return
    on_compiling.append(_tell_of_compiling)
    status = 0
    try:
        _run(sys.argv[1:])
        sys.stdout.flush()
    except BrokenPipeError:  # the reader had enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (EchostepError, OSError) as error:
        print(f"echostep: {words_of(error)}", file=sys.stderr)
        status = 2
    except KeyboardInterrupt:
        status = 130
    sys.exit(status)


def _tell_of_compiling() -> None:
    on_compiling.clear()
    print("Compiling kernels, once on a computer: about a minute ...", file=sys.stderr)


def _run(words: list[str]) -> None:
    parser = argparse.ArgumentParser(prog="echostep", description="Indoor pedestrian tracking.", epilog=WHOLE)
    parser.add_argument("--version", action="version", version=f"echostep {version('echostep')}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    decode = commands.add_parser("decode", help="print captured bytes as JSON, one message a line")
    decode.add_argument("file", type=Path, help="captured bytes of the board or of an Xsens MT, or a recording")
    decode.set_defaults(run=_decode)
    foot = commands.add_parser("foot", help="zero-velocity navigation of a recorded foot IMU")
    foot.add_argument("imu", type=Path, help="CSV: t_s,ax,ay,az,gx,gy,gz[,mx,my,mz] in s, m/s2, rad/s")
    foot.add_argument("--out", type=Path, default=Path("track.csv"), metavar="FILE", help="the track to write (CSV)")
    foot.set_defaults(run=_foot)
    replay = commands.add_parser("replay", help="track a recorded walk again")
    replay.add_argument("recording", type=Path, nargs="+", help="the recording (.mcap); several: the parts of one run")
    replay.add_argument("--plan", type=Path, help="the building's plan.json; without one the walk has no map")
    replay.add_argument("--seed", type=int, help="instead of the recorded one")
    replay.add_argument("--out", type=Path, default=Path("out/replay"), metavar="FOLDER", help="folder for track.csv")
    replay.add_argument("--headless", action="store_true", help="without page and terminal view, as always here")
    replay.set_defaults(run=_replay)
    given = parser.parse_args(words)
    given.run(given)


def _decode(given: argparse.Namespace) -> None:
    from echostep.recording import Decoder, as_json, read_capture

    decoder = Decoder()
    for message in read_capture(given.file, decoder):
        print(json.dumps(as_json(message), allow_nan=False))
    good, bad = decoder.board.counts.good + decoder.foot.counts.good, decoder.board.counts.rejected
    skipped = decoder.mt.counts.skipped_bytes
    print(f"board: {good} frames, {bad} rejected; MT: {skipped} bytes in no frame", file=sys.stderr)


def _foot(given: argparse.Namespace) -> None:
    from echostep.offline.imu_csv import describe_track, load_imu, own_track, write_foot_track

    imu, name = load_imu(given.imu), given.imu.name
    print(*(f"{name}: {note}" for note in imu.notes), sep="\n", end="\n" * bool(imu.notes))
    track = own_track(imu, name)
    write_foot_track(given.out, track)
    print(f"{name}: {describe_track(track)}\ntrack: {given.out}")


def _replay(given: argparse.Namespace) -> None:
    from echostep.localization import digest
    from echostep.walk.table import write_track
    from echostep.walk.walk import replay

    estimates = replay(given.recording, given.plan, seed=given.seed).estimates
    given.out.mkdir(parents=True, exist_ok=True)
    write_track(given.out / "track.csv", estimates)
    print(f"estimates: {len(estimates)}, sha256 {digest(estimates)[:16]}\nfiles: track.csv in {given.out}")
