# SPDX-License-Identifier: MIT
"""A foot IMU that prints lines: any split gives the same samples, garbage is counted, a clock that is set costs nothing."""

from __future__ import annotations

import re

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from board_runs import ROOT
from echostep.ports.chunks import MTX
from echostep.xsens import MtxReader
from echostep_app.session.runs.live_lines import LONGEST_LINE, LineChunks, LineReader

TEXT = (
    b"boot 1.2\r\nt (ms),ax (g),ay (g),az (g),gx (deg/s),gy (deg/s),gz (deg/s)\r\n0,0,0,1,180,0,0\r\n10,1,0,0,0,0,0\n"
)


def test_the_header_gives_names_and_units() -> None:
    reader = LineReader()
    samples = reader.feed(TEXT)
    assert np.allclose(samples, [[0, 0, 0, 9.80665, np.pi, 0, 0], [0.01, 9.80665, 0, 0, 0, 0, 0]])
    assert reader.unreadable == 1


@given(st.lists(st.integers(0, len(TEXT)), max_size=5).map(sorted))
def test_any_split_gives_the_same_samples(cuts: list[int]) -> None:
    reader, edges = LineReader(), [0, *cuts, len(TEXT)]
    parts = [reader.feed(TEXT[begin:end]) for begin, end in zip(edges, edges[1:], strict=False)]
    assert np.array_equal(np.concatenate(parts), LineReader().feed(TEXT))


@given(st.binary(max_size=200))
def test_garbage_costs_its_own_lines_and_is_counted(garbage: bytes) -> None:
    reader = LineReader()
    reader.feed(TEXT + garbage + b"\n")
    assert len(reader.feed(b"20,1,0,0,0,0,0\n")) == 1


def test_what_is_no_sample_is_counted() -> None:
    reader = LineReader()
    reader.feed(b"1,2,3,4,5,6,7\n" + TEXT)  # before the names
    bad = (
        b"20,nan,0,0,0,0,0\n",
        b"30,1\n",
        b"1e18,1,0,0,0,0,0\n",
        b"40,1,0,0,0,0,0,8\n",
        b"9" * 3 * LONGEST_LINE + b"\n",
    )
    assert sum(len(reader.feed(line)) for line in bad) == 0
    assert reader.unreadable == 2 + len(bad)


def test_a_datagram_needs_no_line_end() -> None:
    reader = LineReader()
    reader.feed(TEXT)
    assert len(reader.feed(b"\x0020,1,0,0,0,0,0\0\x0030,1,0,0,0,0,0\0")) == 2


def test_the_sketch_of_the_manual_prints_what_is_read() -> None:
    printed = re.findall(r'print[f]?\("(.*?)\\n"', (ROOT / "host/docs/foot.md").read_text())
    assert len(printed) == 2
    reader = LineReader()
    samples = reader.feed("\n".join([printed[0], printed[1] % (1.5, 1, 2, 9.8, 0.1, 0.2, 0.3), ""]).encode())
    assert np.allclose(samples, [[1.5, 1, 2, 9.8, 0.1, 0.2, 0.3]])


def test_a_clock_that_is_set_goes_on_by_the_arrivals() -> None:
    """A device that restarts after a second, with the host's clock 0.5 s on; one sample comes late and is left out."""
    row = [0.0, 0.0, 0.0, 9.81, 0.1, 0.0, 0.0]
    chunks, reader = LineChunks(100.0), MtxReader()
    times = [(10.0, 0), (10.99, 990_000_000), (10.5, 995_000_000), (0.0, 1_490_000_000), (0.01, 1_500_000_000)]
    made = [chunk for t_s, ns in times for chunk in chunks.of(np.array([[t_s, *row[1:]]]), ns)]
    assert [chunk.t_arrival_ns for chunk in made] == [0, 990_000_000, 1_490_000_000, 1_500_000_000]
    assert {chunk.port for chunk in made} == {MTX}
    assert reader.feed_batch(b"".join(chunk.data for chunk in made)).counter.tolist() == [0, 99, 149, 150]
    assert (chunks.jumps, chunks.left_out) == (1, 1)
