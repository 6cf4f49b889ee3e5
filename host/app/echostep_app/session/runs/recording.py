# SPDX-License-Identifier: MIT
"""The recording of a run: a new file each time, and what the terminal says of it.

In: the name asked for, metadata, how many recordings to keep. Out: an open `Recorder`; lines on the terminal. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from echostep_app.printing.console import console
from echostep_app.recording.names import link_newest, remove_older
from echostep_app.recording.numbered import numbered_recorder
from echostep_app.recording.recorder import Recorder
from echostep_app.recording.splitting import SplitLimit


def start_recording(
    wanted: Path, metadata: Mapping[str, str], keep: int | None = None, split: SplitLimit | None = None
) -> Recorder:
    """A recorder on a new file named after `wanted`; raises EchostepError. `keep`: remove the oldest until so many are left. `split`: in parts."""
    recorder = numbered_recorder(wanted, metadata, split)
    if link_newest(recorder.path, wanted):
        console.print(f"Recording: {recorder.path}, also named {wanted.name}", highlight=False)
    else:
        other = f"; {wanted.name} is another file and stays as it is" if wanted.exists() else ""
        console.print(f"Recording: {recorder.path}{other}", highlight=False)
    for path in remove_older(wanted, keep) if keep else ():
        console.print(f"Removed: {path} (--keep {keep})", highlight=False)
    return recorder
