# SPDX-License-Identifier: MIT
"""All packets of an MTData2 message, by name, to inspect captures.

In: the payload of an MTData2 message. Out: packets with their names and values; of an unknown packet or size the bytes alone. Owns
nothing; raises ValueError for a payload whose lengths disagree. [LLCP, MTData2: data identifiers and their fields; MTw: CMT].
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
    0x5010: ("AltitudeMsl", ("",)),
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
_RAW = "AccX AccY AccZ GyrX GyrY GyrZ MagX MagY MagZ Temperature"
INTEGERS = {  # packets of integers: name, layout, fields
    0x1010: ("UTCTime", ">IHBBBBBB", ("Ns", "Year", "Month", "Day", "Hour", "Minute", "Second", "Flags")),
    0x1020: ("PacketCounter", ">H", ("",)),
    0x1030: ("ITOW", ">I", ("",)),
    0x1040: ("GnssAge", ">B", ("",)),
    0x1050: ("PressureAge", ">B", ("",)),
    0x1060: ("SampleTimeFine", ">I", ("",)),
    0x1070: ("SampleTimeCoarse", ">I", ("",)),
    0x1090: ("PacketCounter8", ">B", ("",)),
    0x10A0: ("SampleTime64", ">Q", ("",)),
    0x3010: ("BaroPressure", ">I", ("",)),
    0x7010: ("GNSSPVTData", ">IHBBBBBBIiBBBBiiiiIIiiiiiIIi7H", tuple(_PVT.split())),
    0xA010: ("RawAccGyrMagTemp", ">10H", tuple(_RAW.split())),
    0xA030: ("RawAcc", ">3H", tuple("XYZ")),
    0xA040: ("RawGyr", ">3H", tuple("XYZ")),
    0xA050: ("RawMag", ">3H", tuple("XYZ")),
    0xB010: ("AnalogIn1", ">H", ("",)),
    0xB020: ("AnalogIn2", ">H", ("",)),
    0xE010: ("StatusByte", ">B", ("",)),
    0xE020: ("StatusWord", ">I", ("",)),
    0xE040: ("Rssi", ">b", ("",)),
    0xE080: ("DeviceId", ">I", ("",)),
}
SATELLITES = 0x7020
HEAD = 3  # bytes before a packet's content: identifier (2), length (1)
SATELLITE_HEAD, SATELLITE = 8, 4  # bytes of GNSSSatInfo before the satellites, and of each satellite


class Packet(NamedTuple):
    """One packet; `form` (number format) and `world` are bits of the identifier.

    `name`: "" if unknown. `fields`: values by the field's name, "" if there is only one; none for an unknown packet or size. `content`: its bytes.
    """

    identifier: int
    name: str
    form: int
    world: int
    fields: dict[str, float]
    content: bytes


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
    """The packet with this identifier."""
    kind, form, world = identifier & TYPE_MASK, identifier & FORMAT_MASK, identifier & WORLD_MASK
    name, fields = "", dict[str, float]()
    if kind in NUMBERS:
        name, names = NUMBERS[kind]
        if len(content) == len(names) * WIDTHS[form]:
            numbers = read_numbers(np.frombuffer(content, np.uint8)[None], form)
            fields = dict(zip(names, numbers[0].tolist(), strict=True))
    elif kind in INTEGERS:
        name, layout, names = INTEGERS[kind]
        if len(content) == struct.calcsize(layout):
            fields = dict(zip(names, struct.unpack(layout, content), strict=True))
    elif kind == SATELLITES:
        name, fields = "GNSSSatInfo", _satellites(content)
    return Packet(identifier, name, form, world, fields, content)


def _satellites(content: bytes) -> dict[str, float]:
    """Fields of GNSSSatInfo: time of week, number of satellites; for each: system, number, carrier to noise (dBHz), flags. Empty for a wrong size."""
    if len(content) < SATELLITE_HEAD or len(content) != SATELLITE_HEAD + SATELLITE * content[4]:
        return {}
    fields: dict[str, float] = dict(
        zip(("ITOW", "NumSVS", "Res1", "Res2", "Res3"), struct.unpack_from(">IBBBB", content), strict=True)
    )
    for k in range(content[4]):
        begin = SATELLITE_HEAD + SATELLITE * k
        for name, value in zip(("GnssId", "SvId", "Cno", "Flags"), content[begin : begin + SATELLITE], strict=True):
            fields[f"{name}{k}"] = value
    return fields
