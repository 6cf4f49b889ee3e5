# SPDX-License-Identifier: MIT
"""What serial lines add to a board's bytes costs the frames that it touches alone, and each is counted."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from board_runs import ROOT
from echostep.board.frames import BoardReader

CAPTURE = (ROOT / "tests/captures/board.bin").read_bytes()  # it begins in the middle of a frame


def zero_inside(capture: bytes) -> bytes:
    """A zero in the eleventh frame, as by a flipped bit."""
    frames = capture.split(b"\0")
    frames[10] = frames[10][:5] + b"\0" + frames[10][5:]
    return b"\0".join(frames)


LINES: dict[
    str, tuple[Callable[[bytes], bytes], int, int]
] = {  # what is done to the bytes, frames lost, frames rejected beside those of the capture
    "nothing": (bytes, 0, 0),
    "one byte before [electricui-embedded, issue 180]": (lambda c: b"\x55" + c, 0, 1),
    "zeros before": (lambda c: bytes(50) + c, 0, 0),
    "two delimiters a frame": (lambda c: c.replace(b"\0", b"\0\0"), 0, 0),
    "no last delimiter": (lambda c: c.rstrip(b"\0"), 1, 0),
    "a zero inside a frame [nanocobs, issue 43]": (zero_inside, 1, 2),
    "flow control by software": (lambda c: c[:3000] + b"\x11" + c[3000:6000] + b"\x13" + c[6000:], 2, 2),
    "a hundred thousand bytes of noise": (lambda c: c[:5000] + b"\xff" * 100_000 + c[5000:], 1, 1),
    "a terminal that translates line ends": (lambda c: c.replace(b"\n", b"\r\n"), 46, 46),
    "ModemManager's questions": (lambda c: b"ModemManager AT+GCAP\r" * 3 + c, 0, 1),
}


@pytest.mark.parametrize("line", LINES)
def test_only_what_is_touched_is_lost_and_it_is_counted(line: str) -> None:
    change, lost, rejected = LINES[line]
    whole, reader = BoardReader(), BoardReader()
    whole.feed(CAPTURE)
    reader.feed(change(CAPTURE))
    assert (whole.counts.good - reader.counts.good, reader.counts.rejected - whole.counts.rejected) == (lost, rejected)
    assert reader.counts.lost - whole.counts.lost in (lost, lost - (line == "no last delimiter"))
