"""All packets of an MTData2 message, by name, to inspect captures.

In: the payload of an MTData2 message. Out: packets with their names and values. Owns nothing; raises ValueError for a payload whose lengths disagree.
[LLCP, MTData2: data identifiers and their fields].
"""

from __future__ import annotations

import struct
from typing import NamedTuple

import numpy as np

from echostep.xsens.mtdata2 import FORMAT_MASK, TYPE_MASK, WIDTHS, WORLD_MASK, read_numbers

NUMBERS = {  # packets in one of the four number formats: name, fields
    0x0810: ("Temperature", ("",)),
    0x2010: ("Quaternion", ("Q0", "Q1", "Q2", "Q3")),
    0x2020: ("RotationMatrix", tuple("ABCDEFGHI")),
    0x2030: ("EulerAngles", tuple("XYZ")),
    0x4010: ("DeltaV", tuple("XYZ")),
    0x4020: ("Acceleration", tuple("XYZ")),
    0x4030: ("FreeAcceleration", tuple("XYZ")),
    0x4040: ("AccelerationHR", tuple("XYZ")),
    0x5020: ("AltitudeEllipsoid", ("",)),
    0x5030: ("PositionECEF", tuple("XYZ")),
    0x5040: ("LatLon", ("Lat", "Lon")),
    0x8020: ("RateOfTurn", tuple("XYZ")),
    0x8030: ("DeltaQ", ("Q0", "Q1", "Q2", "Q3")),
    0x8040: ("RateOfTurnHR", tuple("XYZ")),
    0xC020: ("MagneticField", tuple("XYZ")),
    0xD010: ("VelocityXYZ", tuple("XYZ")),
}
_PVT = (
    "ITOW Year Month Day Hour Min Sec Valid TAcc Nano FixType Flags NumSV Reserved1 Lon Lat Height HMSL HAcc VAcc "
    "VelN VelE VelD GSpeed HeadMot SAcc HeadAcc HeadVeh GDOP PDOP TDOP VDOP HDOP NDOP EDOP"
)
INTEGERS = {  # packets of integers: name, layout, fields
    0x1010: ("UTCTime", ">IHBBBBBB", ("Ns", "Year", "Month", "Day", "Hour", "Minute", "Second", "Flags")),
    0x1020: ("PacketCounter", ">H", ("",)),
    0x1030: ("ITOW", ">I", ("",)),
    0x1060: ("SampleTimeFine", ">I", ("",)),
    0x1070: ("SampleTimeCoarse", ">I", ("",)),
    0x3010: ("BaroPressure", ">I", ("",)),
    0x7010: ("GNSSPVTData", ">IHBBBBBBIiBBBBiiiiIIiiiiiIIi7H", tuple(_PVT.split())),
    0xE010: ("StatusByte", ">B", ("",)),
    0xE020: ("StatusWord", ">I", ("",)),
}
SATELLITES = 0x7020
HEAD = 3  # bytes before a packet's content: identifier (2), length (1)
SATELLITE_HEAD, SATELLITE = 8, 4  # bytes of GNSSSatInfo before the satellites, and of each satellite


class Packet(NamedTuple):
    """One packet; `form` (number format) and `world` are bits of the identifier.

    `name`: "" if unknown. `fields`: values by the field's name, "" if there is only one.
    """

    identifier: int
    name: str
    form: int
    world: int
    fields: dict[str, float]


def read_packets(payload: bytes) -> list[Packet]:
    """All packets of a payload; raises ValueError when their lengths do not fill it."""
    packets, begin = [], 0
    while begin < len(payload):
        content = begin + HEAD
        if content > len(payload) or content + payload[content - 1] > len(payload):
            raise ValueError(f"MTData2: a packet at byte {begin} ends outside its message")
        identifier, size = struct.unpack_from(">HB", payload, begin)
        packets.append(_decode(identifier, payload[content : content + size]))
        begin = content + size
    return packets


def _decode(identifier: int, content: bytes) -> Packet:
    """The packet with this identifier; raises ValueError for content of a wrong size."""
    kind, form, world = identifier & TYPE_MASK, identifier & FORMAT_MASK, identifier & WORLD_MASK
    if kind in NUMBERS:
        name, fields = NUMBERS[kind]
        _check_size(name, content, len(fields) * WIDTHS[form])
        numbers = read_numbers(np.frombuffer(content, np.uint8)[None, :], form)[0]
        return Packet(identifier, name, form, world, dict(zip(fields, numbers.tolist(), strict=True)))
    if kind in INTEGERS:
        name, layout, fields = INTEGERS[kind]
        _check_size(name, content, struct.calcsize(layout))
        return Packet(identifier, name, form, world, dict(zip(fields, struct.unpack(layout, content), strict=True)))
    if kind == SATELLITES:
        return Packet(identifier, "GNSSSatInfo", form, world, _satellites(content))
    return Packet(identifier, "", form, world, {})


def _satellites(content: bytes) -> dict[str, float]:
    """Fields of GNSSSatInfo: time of week, number of satellites; of each: system, number, carrier to noise (dBHz), flags."""
    if len(content) < SATELLITE_HEAD or len(content) != SATELLITE_HEAD + SATELLITE * content[4]:
        raise ValueError(f"MTData2: GNSSSatInfo of {len(content)} bytes does not fit its number of satellites")
    fields: dict[str, float] = dict(
        zip(("ITOW", "NumSVS", "Res1", "Res2", "Res3"), struct.unpack_from(">IBBBB", content), strict=True)
    )
    for k in range(content[4]):
        begin = SATELLITE_HEAD + SATELLITE * k
        for name, value in zip(("GnssId", "SvId", "Cno", "Flags"), content[begin : begin + SATELLITE], strict=True):
            fields[f"{name}{k}"] = value
    return fields


def _check_size(name: str, content: bytes, size: int) -> None:
    """Raise ValueError unless the content has this size in bytes."""
    if len(content) != size:
        raise ValueError(f"MTData2: {name} has {len(content)} bytes, not {size}")
