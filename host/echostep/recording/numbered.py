# SPDX-License-Identifier: MIT
"""A recorder on a new file of this run.

In: the name asked for, metadata. Out: an open `Recorder` on a file of a new number (`names.py`). Owns nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from echostep.recording.names import RecordingExistsError, new_name
from echostep.recording.recorder import Recorder

TRIES = 10  # of a new name, while other processes take the same one; assumed


def numbered_recorder(wanted: Path, metadata: Mapping[str, str]) -> Recorder:
    """A recorder on a new file named after `wanted`; raises EchostepError."""
    for _ in range(TRIES - 1):
        try:
            return Recorder(new_name(wanted), metadata)
        except RecordingExistsError:
            continue
    return Recorder(new_name(wanted), metadata)
