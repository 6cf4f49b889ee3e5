# SPDX-License-Identifier: MIT
"""A recorder on a new file of this run.

In: the name asked for, metadata. Out: an open `Recorder` on a file of a new number (`names.py`). Owns nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from echostep_app.recording.names import RecordingExistsError, new_name
from echostep_app.recording.recorder import Recorder
from echostep_app.recording.splitting import SplitLimit, SplitRecorder

TRIES = 10  # of a new name, while other processes take the same one; assumed


def numbered_recorder(wanted: Path, metadata: Mapping[str, str], split: SplitLimit | None = None) -> Recorder:
    """A recorder on a new file named after `wanted`, in parts by `split`; raises EchostepError."""
    for _ in range(TRIES - 1):
        try:
            return _recorder(new_name(wanted), metadata, split)
        except RecordingExistsError:
            continue
    return _recorder(new_name(wanted), metadata, split)


def _recorder(path: Path, metadata: Mapping[str, str], split: SplitLimit | None) -> Recorder:
    return SplitRecorder(path, metadata, split) if split else Recorder(path, metadata)
