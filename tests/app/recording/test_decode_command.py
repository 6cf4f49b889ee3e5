# SPDX-License-Identifier: MIT
"""`echostep decode`: what it prints, what it says of what it found, its options."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import command_line
from echostep.recording import Decoder, read_capture
from echostep.xsens import MTDATA, encode_frame
from echostep_app.recording.capture_summary import summary
from recording.test_decode import CAPTURES, NAMES, legacy, sample


def test_the_command_tells_in_sentences_what_it_found(tmp_path: Path) -> None:
    path = tmp_path / "legacy.bin"
    path.write_bytes(b"".join(legacy(n, 2, 0) for n in range(30)) + b"\xfa\xff\x00")
    done = command_line.echostep("decode", path)
    assert len(done.stdout.splitlines()) == 30
    assert json.loads(done.stdout.splitlines()[0])["mag"] == list(sample(0).mag)
    assert done.stderr.splitlines() == [
        "MT: 30 valid frames: 30 MtSample; 3 bytes outside of frames, no wrong checksums.",
        "MT: MTData of 36 bytes: output mode 0x0002, output settings 0x00000000, by the length and the values.",
        "The tracker would use no samples and refuse 30 of another length.",
    ]


def test_the_options_are_read_or_named(tmp_path: Path) -> None:
    path = tmp_path / "legacy.bin"
    path.write_bytes(legacy(0, 2, 0x20))
    done = command_line.echostep("decode", path, "--output-mode", "2", "--output-settings", "0x20")
    assert "mag" in json.loads(done.stdout)
    assert "0x00000020, given." in done.stderr
    assert (
        "--output-mode 99999: a number up to 0xFFFF"
        in command_line.echostep("decode", path, "--output-mode", "99999").stderr
    )


@pytest.mark.parametrize("name", NAMES)
def test_the_command_prints_the_same(name: str) -> None:
    done = command_line.echostep("decode", CAPTURES / name)
    assert done.stdout == (CAPTURES / name).with_suffix(".jsonl").read_text()


@pytest.mark.parametrize(
    ("sent", "words"),
    [
        (b"".join(legacy(n, bus=bus) for n in range(3) for bus in (1, 2, 3, 4)), "from bus 1, 2, 3 and 4"),
        (encode_frame(MTDATA, b"\x7f\xff" * 20), "MTData of 40 bytes: no output mode fits"),
    ],
)
def test_the_summary_names_devices_and_what_no_format_fits(tmp_path: Path, sent: bytes, words: str) -> None:
    decoder, path = Decoder(), tmp_path / "capture.bin"
    path.write_bytes(sent)
    list(read_capture(path, decoder))
    assert words in "\n".join(summary(decoder))
