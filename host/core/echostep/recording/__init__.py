# SPDX-License-Identifier: MIT
"""Recordings: all received chunks of a run in an MCAP file, read; `echostep_app.recording` writes, describes, cuts and repairs them.

In: a file. Out: its portions of chunks, its metadata, its damage. Owns the file while it is read.
"""

from typing import TYPE_CHECKING

from echostep.additions import face

if TYPE_CHECKING:
    from echostep.file_mode import SUFFIX, is_being_written
    from echostep.recording.capture import Decoder, as_json, port_of_bytes, read_capture
    from echostep.recording.clock import clock_of, log_offset_ns, utc_offset_ns, with_log_time
    from echostep.recording.joining import open_parts
    from echostep.recording.mcap_records import MCAP_MAGIC
    from echostep.recording.reading import Recording, open_recording

__getattr__ = face(__name__)
