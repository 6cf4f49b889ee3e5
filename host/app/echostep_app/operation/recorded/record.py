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
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from echostep.ports.chunks import Chunk
from echostep_app.operation.operation import Operation
from echostep_app.output.foxglove import log_line
from echostep_app.recording.splitting import numbered_recorder
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
    """Writes an operation to a new file, numbered after `wanted`. Never waits for the disk.

    `file`: the recorder of the file. Raises EchostepError when it cannot be created.
    """

    def __init__(self, wanted: Path, operation: Operation, broker: str) -> None:
        fields = {
            "kind": KIND,
            "version": importlib.metadata.version("echostep"),
            "plan_name": operation.plan.name,
            "plan_sha256": operation.plan.digest,
            "broker": broker,
            "started_utc": datetime.now(UTC).isoformat(timespec="milliseconds"),
            "started_ns": str(time.monotonic_ns()),
        }
        self.file = numbered_recorder(wanted, fields)
        self._operation = operation
        self._condition: Condition | None = None
        self._counted_s = -math.inf
        self._newest_ns = 0
        self._faults = 0  # of the output, that are recorded

    def add(
        self,
        believed: Sequence[ReceivedMessage],
        now_s: float,
        unix_s: float,
        *,
        connected: bool,
        faults: Sequence[str] = (),
    ) -> None:
        """Record accepted messages, and why an output takes nothing any more, each of the `faults` once; then the state of the operation."""
        for m in sorted(believed, key=lambda message: message.received_s):
            self._write(m.received_s, Heard(m.unix_s, m.retained, m.topic or "", m.payload))
        self.file.write_derived(log_line(round(now_s * 1e9), fault) for fault in faults[self._faults :])
        self._faults = max(self._faults, len(faults))
        roster = self._operation.roster
        self._add_condition(now_s, Condition(unix_s, connected, roster.received, dict(roster.rejected)))

    def _add_condition(self, now_s: float, new: Condition) -> None:
        """Record the state of the connection and the counts, when the state has changed, or counts of rejected messages after `COUNTS_S`."""
        last = self._condition
        counted = (last is not None and new.rejected == last.rejected) or now_s - self._counted_s < COUNTS_S
        if last is None or new.connected != last.connected or not counted:
            self._condition, self._counted_s = new, now_s
            self._write(now_s, new)

    def _write(self, t_s: float, record: Heard | Condition) -> None:
        self._newest_ns = max(self._newest_ns, round(t_s * 1e9))  # times of a port never decrease
        self.file.write(Chunk(OPERATION, self._newest_ns, msgspec.msgpack.encode(record)))
