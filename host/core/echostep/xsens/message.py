# SPDX-License-Identifier: MIT
"""Every valid frame of an MT as a message that a person can read: nothing is dropped, gated or turned.

In: bytes of a captured port. Out: `MtMessage`s in order, and how many counters of 16 bits never came. Owns the unfinished frame, the formats of
MTData, the last counter and the counts. The tracker does not use it: its samples pass the gates of reader.py.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from echostep.xsens.axes import ENU, NED, NWU, from_values
from echostep.xsens.frames import BUS_ID, CONFIGURATION, LONGEST, MTDATA, MTDATA2, Frame, FrameReader, MtFrameCounts
from echostep.xsens.mtdata import ACCEL, ATTITUDE, CELSIUS, GYRO, MAG, Quaternion, Vector, decode_mtdata, rest_of
from echostep.xsens.output_formats import OutputFormats, configured_devices
from echostep.xsens.packets import Packet, read_packets

SHARED_GAP = 500  # counters; a longer step is called a jump, not lost messages; assumed
WORLDS = {ENU: "east, north, up", NED: "north, east, down", NWU: "north, west, up"}
NAMES = {  # of messages without a measurement [LLCP, message identifiers]
    0x01: "DeviceID", 0x05: "SetPeriodAck", 0x0D: "Configuration", 0x11: "GoToMeasurementAck", 0x13: "FirmwareRevision", 0x31: "GoToConfigAck",
    0x3E: "WakeUp", 0x42: "Error", 0xC1: "SetOutputConfigurationAck", 0xD1: "SetOutputModeAck", 0xD3: "SetOutputSettingsAck",
    0xD5: "SetOutputSkipFactorAck",
}  # fmt: skip
# The packets that become fields of a message: name, field.
_VECTORS = {"Acceleration": "accel", "RateOfTurn": "gyro", "MagneticField": "mag"}
_ORIENTATIONS = ("Quaternion", "RotationMatrix", "EulerAngles")


@dataclass(slots=True)
class CounterGaps:
    """Counters of one device: those that never came, and steps that are no gap (a restart, or a long silence)."""

    lost: int = 0
    jumps: int = 0
    _last: int = -1
    _others: set[int] = field(default_factory=set)

    def note(self, counter: int, *, sample: bool) -> None:
        """Count the step from the last sample. Other messages share the counter or have their own: they only explain a gap."""
        if not sample:
            if len(self._others) <= SHARED_GAP:
                self._others.add(counter)
            return
        step = (counter - self._last) & 0xFFFF
        if self._last >= 0 and step > SHARED_GAP:
            self.jumps += 1
        elif self._last >= 0 and step > 1:
            self.lost += sum((self._last + k) & 0xFFFF not in self._others for k in range(1, step))
        self._last = counter
        self._others.clear()


class MtMessage(NamedTuple):
    """One valid frame. A field is None if it was not sent.

    `name`: MtSample for a measurement with accel, gyro, mag or orientation, else the message's name, "" if unknown. accel m/s2, gyro rad/s, mag in
    the earth's field (sensor frame); quaternion w x y z (sensor -> `world`). `packets`: packets of MTData2 that are no field, and the rest of MTData.
    `payload`: of a message that could not be read whole, else None.
    """

    name: str
    mid: int
    bus: int
    counter: int | None = None
    accel: Vector | None = None
    gyro: Vector | None = None
    mag: Vector | None = None
    quaternion: Quaternion | None = None
    world: int | None = None
    celsius: float | None = None
    packets: tuple[dict[str, object], ...] = ()
    payload: bytes | None = None


@dataclass(slots=True)
class MessageReader:
    """Messages of a byte stream, and counts: `names` of the messages by bus and name, `unread` payloads, `gaps` by bus."""

    formats: OutputFormats = field(default_factory=OutputFormats)
    names: Counter[tuple[int, str]] = field(default_factory=Counter)
    unread: int = 0
    gaps: dict[int, CounterGaps] = field(default_factory=dict)
    _frames: FrameReader = field(default_factory=lambda: FrameReader(LONGEST))

    @property
    def counts(self) -> MtFrameCounts:
        """Bytes outside of frames, and wrong checksums."""
        return self._frames.counts

    def feed(self, received: bytes, *, ended: bool = False) -> list[MtMessage]:
        """Messages completed by these bytes; `ended`: no byte follows."""
        frames = self._frames.feed(received, ended=ended)
        self.formats.learn(frames)
        messages = [self._message(frame) for frame in frames]
        for message in messages:
            self.names[message.bus, message.name] += 1
            self.unread += message.payload is not None and message.mid in (MTDATA, MTDATA2)
            if message.counter is not None:
                gaps = self.gaps.setdefault(message.bus, CounterGaps())
                gaps.note(message.counter, sample=message.name == "MtSample")
        return messages

    def _message(self, frame: Frame) -> MtMessage:
        if frame.mid == MTDATA:
            return self._legacy(frame)
        if frame.mid == MTDATA2:
            return _from_packets(frame)
        packets = tuple(
            {"device": f"{device:08X}", "length": length, "output_mode": f"0x{mode:04X}", "output_settings": f"0x{settings:08X}"}
            for device, length, mode, settings in configured_devices(frame.payload)
            if frame.mid == CONFIGURATION
        )  # fmt: skip
        return MtMessage(NAMES.get(frame.mid, ""), frame.mid, frame.bus, packets=packets, payload=frame.payload)

    def _legacy(self, frame: Frame) -> MtMessage:
        """MTData in the format that was found for its length; without a format, its bytes."""
        output = self.formats.of(frame.bus, len(frame.payload))
        if output is None:
            return MtMessage("MTData", frame.mid, frame.bus, payload=frame.payload)
        values, counter, sent = decode_mtdata(np.frombuffer(frame.payload, np.uint8)[None, :], output)
        row, (accel, gyro, mag, oriented) = values[0], sent[0].tolist()
        return MtMessage(
            "MtSample" if sent.any() else "MTData", frame.mid, frame.bus,
            int(counter[0]) if counter[0] >= 0 else None,
            tuple(row[ACCEL].tolist()) if accel else None,
            tuple(row[GYRO].tolist()) if gyro else None,
            tuple(row[MAG].tolist()) if mag else None,
            tuple(row[ATTITUDE].tolist()) if oriented else None,
            NWU if oriented else None,
            None if np.isnan(row[CELSIUS]) else float(row[CELSIUS]),
            tuple({"name": name, "value": value} for name, value in rest_of(frame.payload, output).items()),
        )  # fmt: skip


def _from_packets(frame: Frame) -> MtMessage:
    """An MTData2 message: the first packet of each quantity of a sample is a field, the others are packets."""
    try:
        packets = read_packets(frame.payload)
    except ValueError:
        return MtMessage("MTData2", frame.mid, frame.bus, payload=frame.payload)
    fields: dict[str, object] = {}
    others = []
    for packet in packets:
        name, values = packet.name, tuple(packet.fields.values())
        if values and name in _VECTORS and _VECTORS[name] not in fields:
            fields[_VECTORS[name]] = values
        elif values and name == "PacketCounter" and "counter" not in fields:
            fields["counter"] = int(values[0])
        elif values and name == "Temperature" and "celsius" not in fields:
            fields["celsius"] = values[0]
        elif values and name in _ORIENTATIONS and packet.world in WORLDS and "quaternion" not in fields:
            fields["quaternion"], fields["world"] = tuple(from_values(np.array([values]))[0].tolist()), packet.world
            others += [] if name == "Quaternion" else [_as_object(packet)]
        else:
            others.append(_as_object(packet))
    measured = any(name in fields for name in ("accel", "gyro", "mag", "quaternion"))
    return MtMessage("MtSample" if measured else "MTData2", frame.mid, frame.bus, packets=tuple(others), **fields)  # type: ignore[arg-type]


def _as_object(packet: Packet) -> dict[str, object]:
    """A packet with its name, its world if it has one, and its value or its fields; an unknown one as hex."""
    if not packet.fields:
        named = {"name": packet.name} if packet.name else {}
        return {"id": f"0x{packet.identifier:04X}", **named, "hex": packet.content.hex()}
    known: dict[str, object] = {"name": packet.name}
    if packet.name in _ORIENTATIONS:
        known["world"] = WORLDS.get(packet.world, "unknown")
    if len(packet.fields) == 1:
        return {**known, "value": next(iter(packet.fields.values()))}
    return {**known, **packet.fields}


def as_object(message: MtMessage) -> dict[str, object]:
    """The message as JSON: its sent fields, the bus unless the device is alone, bytes as hex."""
    names = ("counter", "accel", "gyro", "mag", "quaternion")
    known = {name: value for name in names if (value := getattr(message, name)) is not None}
    if message.world is not None:
        known["world"] = WORLDS[message.world]
    if message.celsius is not None:
        known["celsius"] = message.celsius
    if message.bus != BUS_ID:
        known["bus"] = message.bus
    if message.packets:
        known["packets"] = list(message.packets)
    if message.payload is not None:
        known["hex"] = message.payload.hex()
    if message.mid not in (MTDATA, MTDATA2):
        name = {"name": message.name} if message.name else {}
        return {"message": "MtMessage", **name, "id": f"0x{message.mid:02X}", **known}
    return {"message": message.name, **known}
