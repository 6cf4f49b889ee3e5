# SPDX-License-Identifier: MIT
"""The recording of an operation: every accepted message, and the counts of rejected ones.

In: messages as an inbox received them, the state of the connection. Out: chunks of the port `OPERATION` of an MCAP file; records from such chunks,
which may be damaged or hostile. Owns the open file. Rejected messages are counted, not kept: a flood of them fills no disk.

A chunk is one record in MessagePack, an array that begins with its name; its arrival time is on the commander's monotonic clock:

    ["heard", Unix time in s, retained by the broker, topic, payload]
    ["state", Unix time in s, connected to the broker, number of messages heard, {reason: number of messages rejected}]
"""

from __future__ import annotations

import importlib.metadata
import math
import time
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from echostep.plan.model import Plan
from echostep.ports.chunks import Chunk
from echostep_app.output.foxglove import log_line
from echostep_app.recording.numbered import numbered_recorder
from echostep_app.team.inbox import ReceivedMessage
from echostep_app.team.messages.report import MAX_PAYLOAD, printable
from echostep_app.team.roster import MAX_REASONS

OPERATION = "operation"  # name of the port
KIND = "operation"  # value of the metadata's field `kind`
COUNTS_S = 1.0  # between two records of changed counts; assumed
MOST_TOPIC = 200  # characters; the longest that is believed has about 100
MOST_BYTES = MAX_PAYLOAD + 1024  # of one record

Seconds = Annotated[float, Meta(ge=-1e10, le=1e11)]


class Heard(msgspec.Struct, frozen=True, array_like=True, tag="heard"):
    """An accepted message."""

    unix_s: Seconds
    retained: bool
    topic: Annotated[str, Meta(max_length=MOST_TOPIC)]
    payload: Annotated[bytes, Meta(max_length=MAX_PAYLOAD)]


class Condition(msgspec.Struct, frozen=True, array_like=True, tag="state"):
    """The state of the connection, and counts since the beginning."""

    unix_s: Seconds
    connected: bool
    received: Annotated[int, Meta(ge=0, lt=1 << 53)]
    rejected: Annotated[
        dict[Annotated[str, Meta(max_length=100)], Annotated[int, Meta(ge=0, lt=1 << 53)]], Meta(max_length=MAX_REASONS + 1)
    ]  # fmt: skip


_DECODER = msgspec.msgpack.Decoder(Heard | Condition)


def decode_record(data: bytes) -> Heard | Condition | None:
    """The record in a chunk; None for bytes that are none."""
    if len(data) > MOST_BYTES:
        return None
    try:
        record: Heard | Condition = _DECODER.decode(data)
    except (msgspec.MsgspecError, UnicodeError, RecursionError):
        return None
    if isinstance(record, Condition):
        return msgspec.structs.replace(record, rejected={printable(k, 100): n for k, n in record.rejected.items()})
    return record


class OperationRecorder:
    """Writes an operation to a new file, numbered after `wanted`; raises EchostepError when it cannot be created. Never waits for the disk."""

    def __init__(self, wanted: Path, plan: Plan, broker: str) -> None:
        fields = {
            "kind": KIND,
            "version": importlib.metadata.version("echostep"),
            "plan_name": plan.name,
            "plan_sha256": plan.digest,
            "broker": broker,
            "started_utc": datetime.now(UTC).isoformat(timespec="milliseconds"),
            "started_ns": str(time.monotonic_ns()),
        }
        self._recorder = numbered_recorder(wanted, fields)
        self.notices = self._recorder.notices
        self._condition: Condition | None = None
        self._counted_s = -math.inf
        self._newest_ns = 0
        self._faults = 0  # of the output, that are recorded

    @property
    def path(self) -> Path:
        """The file."""
        return self._recorder.path

    @property
    def offset(self) -> int:
        """Bytes of the file so far."""
        return self._recorder.offset

    def add(self, messages: Sequence[ReceivedMessage]) -> None:
        """Record accepted messages."""
        for m in sorted(messages, key=lambda message: message.received_s):
            self._write(m.received_s, Heard(m.unix_s, m.retained, m.topic or "", m.payload))

    def add_condition(
        self, now_s: float, unix_s: float, received: int, rejected: Mapping[str, int], *, connected: bool
    ) -> None:
        """Record the state of the connection and the counts, when the state has changed, or counts of rejected messages after `COUNTS_S`."""
        last = self._condition
        new = Condition(unix_s, connected, received, dict(rejected))
        counted = (last is not None and new.rejected == last.rejected) or now_s - self._counted_s < COUNTS_S
        if last is None or connected != last.connected or not counted:
            self._condition, self._counted_s = new, now_s
            self._write(now_s, new)

    def add_faults(self, now_s: float, faults: Sequence[str]) -> None:
        """Record why an output takes nothing any more, each fault once."""
        self._recorder.write_derived(log_line(round(now_s * 1e9), fault) for fault in faults[self._faults :])
        self._faults = len(faults)

    def close(self) -> None:
        """Write the end of the file."""
        self._recorder.close()

    def check_whole(self) -> None:
        """Raises IncompleteError when the closed recording lacks something."""
        self._recorder.check_whole()

    def _write(self, t_s: float, record: Heard | Condition) -> None:
        self._newest_ns = max(self._newest_ns, round(t_s * 1e9))  # times of a port never decrease
        self._recorder.write(Chunk(OPERATION, self._newest_ns, msgspec.msgpack.encode(record)))
