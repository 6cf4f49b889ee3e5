"""MTData2: real captures decode to their golden values, batches agree with packets, every number format and world."""

from __future__ import annotations

import os
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from board_runs import ROOT
from echostep.xsens import MTDATA2, FrameReader, encode_frame
from echostep.xsens.packets import Packet, read_packets

MTB = Path(os.environ.get("ECHOSTEP_DATA", ROOT.parent / "shared/data")) / "mtb"
CAPTURES = [f"einride_{k}" for k in (1, 2, 3, 5)]
needs_captures = pytest.mark.skipif(
    not MTB.exists(), reason="skipped: no recordings (../shared/data or $ECHOSTEP_DATA)"
)
FORMS = ("Float32", "FP1220", "FP1632", "Float64")
Golden = list[tuple[str, list[str]]]


def golden(path: Path) -> list[Golden]:
    """Messages of a golden text: packets with their title and lines."""
    messages: list[Golden] = []
    for block in path.read_text().strip().split("\n\n"):
        packets: Golden = []
        for line in block.splitlines():
            if line.startswith("  "):
                packets[-1][1].append(line.strip())
            else:
                packets.append((line.rstrip(":"), []))
        messages.append(packets)
    return messages


def title(packet: Packet) -> str:
    """As the golden text names it."""
    if packet.identifier >> 12 in (1, 3, 7, 0xE):
        return packet.name
    worlds = {0x2: "EastNorthUp,", 0xD: "EastNorthUp,"} if packet.name not in ("DeltaQ", "") else {}
    return f"{packet.name}({worlds.get(packet.identifier >> 12, '')}{FORMS[packet.form]})"


def agrees(packet: Packet, lines: list[str]) -> bool:
    """Whether values and golden lines are the same to the last bit that the text holds."""
    if packet.name == "UTCTime":
        f = {name: int(value) for name, value in packet.fields.items()}
        whole = datetime(f["Year"], f["Month"], f["Day"], f["Hour"], f["Minute"], f["Second"], tzinfo=UTC)
        text = whole.strftime("%Y-%m-%dT%H:%M:%S")
        fraction = f"{f['Ns']:09d}".rstrip("0")
        return lines == [f"{text}.{fraction}Z" if fraction else f"{text}Z"]
    if packet.name.startswith("Status"):
        return lines == [f"{int(packet.fields['']):0{8 if packet.name == 'StatusByte' else 32}b}"]
    said = dict(line.rpartition(":")[::2] for line in lines)
    known = {name: value for name, value in packet.fields.items() if name in said}
    return set(said) == set(known) and all(
        float(said[name]) == value or (packet.form == 0 and np.float32(said[name]) == np.float32(value))
        for name, value in known.items()
    )


@needs_captures
@pytest.mark.parametrize("name", CAPTURES)
def test_every_value_of_a_real_capture_is_the_golden_one(name: str) -> None:
    frames = FrameReader().feed((MTB / name / "output.bin").read_bytes())
    expected = golden(MTB / name / "output.golden")
    assert len(frames) == len(expected) == 100
    for frame, wanted in zip(frames, expected, strict=True):
        packets = read_packets(frame.payload)
        assert frame.mid == MTDATA2
        assert [title(packet) for packet in packets] == [said for said, _ in wanted]
        assert all(agrees(packet, lines) for packet, (_, lines) in zip(packets, wanted, strict=True)), packets


@needs_captures
@pytest.mark.parametrize("name", CAPTURES)
def test_frames_are_the_golden_frames(name: str) -> None:
    frames = FrameReader().feed((MTB / name / "output.bin").read_bytes())
    lines = (MTB / name / "messages.golden").read_text().split()
    assert [encode_frame(*frame).hex() for frame in frames] == lines
