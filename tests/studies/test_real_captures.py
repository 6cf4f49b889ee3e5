# SPDX-License-Identifier: MIT
"""Captures of real devices: every valid frame comes out, each value is the golden one, batches agree with packets."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from echostep.xsens import MTDATA2, FrameReader, MtxReader, axes
from echostep.xsens.packets import Packet, read_packets
from echostep_studies.frame.recordings import DATA
from needs_data import needs_data
from recording.test_decode import expect_every_frame

MTB = DATA / "mtb"
REAL = sorted(p for end in ("bin", "mtb", "xbus") for p in MTB.glob(f"**/*.{end}"))
CAPTURES = [f"einride_{k}" for k in (1, 2, 3, 5)]
FORMS = ("Float32", "FP1220", "FP1632", "Float64")
Golden = list[tuple[str, list[str]]]
needs_captures = needs_data("mtb")


@needs_captures
@pytest.mark.parametrize("path", REAL, ids=lambda path: "-".join(path.parts[-2:]))
def test_every_valid_frame_of_a_real_capture_comes_out(path: Path) -> None:
    expect_every_frame(path)


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
@pytest.mark.parametrize("name", CAPTURES[:3])
def test_batches_agree_with_the_packets(name: str) -> None:
    """Float32, 12.20 and 16.32: accel, gyro, counter, and the orientation turned from east/north/up to the MT world."""
    captured = (MTB / name / "output.bin").read_bytes()
    reader = MtxReader()
    batch = reader.feed_batch(captured)
    samples = [
        {packet.name: list(packet.fields.values()) for packet in read_packets(frame.payload)}
        for frame in FrameReader().feed(captured)
    ]
    whole = [sample for sample in samples if "RateOfTurn" in sample and "Acceleration" in sample]
    assert len(batch.counter) == len(whole) == 96
    assert reader.counts.incomplete == 4  # satellite messages
    assert batch.counter.tolist() == [sample["PacketCounter"][0] for sample in whole]
    assert batch.accel.tolist() == [sample["Acceleration"] for sample in whole]
    assert batch.gyro.tolist() == [sample["RateOfTurn"] for sample in whole]
    assert np.isnan(batch.mag).all()
    there = [k for k, sample in enumerate(whole) if "EulerAngles" in sample]
    assert len(there) == 95
    euler = axes.from_euler(np.array([whole[k]["EulerAngles"] for k in there]))
    assert np.allclose(batch.quaternion[there], axes.to_mt_world(euler, axes.ENU), atol=1e-12)
    assert np.isnan(batch.quaternion[[k for k in range(96) if k not in there]]).all()


@needs_captures
def test_gravity_points_up() -> None:
    """The captured devices lay still: the measured specific force, turned into the MT world, is gravity upwards."""
    for name in CAPTURES[:3]:
        batch = MtxReader().feed_batch((MTB / name / "output.bin").read_bytes())
        q = batch.quaternion[~np.isnan(batch.quaternion).any(axis=1)]
        accel = batch.accel[~np.isnan(batch.quaternion).any(axis=1)]
        w, x, y, z = q.T
        up = (
            2 * (x * z - w * y) * accel[:, 0]
            + 2 * (y * z + w * x) * accel[:, 1]
            + (1 - 2 * (x * x + y * y)) * accel[:, 2]
        )
        assert np.allclose(up, np.linalg.norm(accel, axis=1), rtol=1e-3)


@needs_captures
def test_quaternion_and_matrix_of_one_capture_agree() -> None:
    compared = 0
    for frame in FrameReader().feed((MTB / "einride_5" / "output.bin").read_bytes()):
        fields = {packet.name: list(packet.fields.values()) for packet in read_packets(frame.payload)}
        if "Quaternion" in fields and "RotationMatrix" in fields:
            found = axes.from_matrix(np.array([fields["RotationMatrix"]]))[0]
            assert abs(np.dot(found, fields["Quaternion"])) == pytest.approx(1.0, abs=1e-5)
            compared += 1
    assert compared == 92
