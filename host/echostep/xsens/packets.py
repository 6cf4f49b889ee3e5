"""Every packet of an MTData2 message, by name, for captures and for people.

In: the payload of an MTData2 message. Out: packets with their names and values. Owns nothing; raises ValueError for a payload that does not add up.
[LLCP, MTData2: data identifiers and their fields].
"""

from __future__ import annotations

import struct
from typing import NamedTuple

import numpy as np

from echostep.xsens.mtdata2 import FORMAT_MASK, TYPE_MASK, WIDTHS, WORLD_MASK, read_numbers

NUMBERS = {  # in one of the four number formats: name, fields
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
INTEGERS = {  # always integers: name, layout, fields
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


class Packet(NamedTuple):
    """One packet: identifier, name ("" if unknown), number format and world (bits of the identifier), values by field ("" for the only one)."""

    identifier: int
    name: str
    form: int
    world: int
    fields: dict[str, float]


def read_packets(payload: bytes) -> list[Packet]:
    """All packets of a payload; raises ValueError when their lengths do not fit."""
    packets, at = [], 0
    while at < len(payload):
        if at + 3 > len(payload) or at + 3 + payload[at + 2] > len(payload):
            raise ValueError(f"MTData2: a packet at byte {at} ends outside its message")
        identifier, size = struct.unpack_from(">HB", payload, at)
        packets.append(_read(identifier, payload[at + 3 : at + 3 + size]))
        at += 3 + size
    return packets


def _read(identifier: int, content: bytes) -> Packet:
    kind, form, world = identifier & TYPE_MASK, identifier & FORMAT_MASK, identifier & WORLD_MASK
    if kind in NUMBERS:
        name, fields = NUMBERS[kind]
        _expect(name, content, len(fields) * WIDTHS[form])
        numbers = read_numbers(np.frombuffer(content, np.uint8)[None, :], form)[0]
        return Packet(identifier, name, form, world, dict(zip(fields, numbers.tolist(), strict=True)))
    if kind in INTEGERS:
        name, layout, fields = INTEGERS[kind]
        _expect(name, content, struct.calcsize(layout))
        return Packet(identifier, name, form, world, dict(zip(fields, struct.unpack(layout, content), strict=True)))
    if kind == SATELLITES:
        return Packet(identifier, "GNSSSatInfo", form, world, _satellites(content))
    return Packet(identifier, "", form, world, {})


def _satellites(content: bytes) -> dict[str, float]:
    """Time of week and number of satellites; of each: system, number, carrier to noise (dBHz), flags."""
    if len(content) < 8 or len(content) != 8 + 4 * content[4]:
        raise ValueError(f"MTData2: GNSSSatInfo of {len(content)} bytes does not fit its number of satellites")
    found: dict[str, float] = dict(
        zip(("ITOW", "NumSVS", "Res1", "Res2", "Res3"), struct.unpack_from(">IBBBB", content), strict=True)
    )
    for k in range(content[4]):
        for field, value in zip(("GnssId", "SvId", "Cno", "Flags"), content[8 + 4 * k : 12 + 4 * k], strict=True):
            found[f"{field}{k}"] = value
    return found


def _expect(name: str, content: bytes, size: int) -> None:
    if len(content) != size:
        raise ValueError(f"MTData2: {name} has {len(content)} bytes, not {size}")
