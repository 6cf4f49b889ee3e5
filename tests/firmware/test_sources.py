# SPDX-License-Identifier: MIT
"""What the firmware's and the twin's sources and pages promise of themselves: sources of models, statements to be measured, atomic reads."""

from __future__ import annotations

import configparser
import re
import shutil
import subprocess

import pytest

from board_runs import ELF, ROOT, needs_twin
from waiting import PATIENCE_S


def test_platformio_builds_the_same_sources_with_the_same_options() -> None:
    ini = configparser.ConfigParser()
    ini.read(ROOT / "platformio.ini")
    make = (ROOT / "firmware/Makefile").read_text()
    (optimize,) = re.findall(r"^OPTIMIZE := (.*)$", make, flags=re.M)
    (linked,) = re.findall(r"\$\(OPTIMIZE\) (-mrelax \S+) -o", make)
    board, flags = ini["env:micro"], ini["env:micro"]["build_flags"].split()
    assert flags == ["-std=c11", "-DCLOCK_START=0ul", *optimize.split(), *linked.split()]
    assert "-std=c11" in make
    assert re.findall(r"wildcard ([^)]+)\)", make)[:2] == re.findall(r"<(\S+)>", board["build_src_filter"])
    assert ini["platformio"]["src_dir"] == "firmware"


@needs_twin
@pytest.mark.skipif(
    not shutil.which("avr-objdump"), reason="avr-objdump is missing (make test installs it when it may)"
)
def test_both_timers_are_read_with_interrupts_off() -> None:
    """An interrupt between the two readings would shift all stamps of the right ranger."""
    command = ["avr-objdump", "-d", str(ELF)]
    listing = subprocess.run(command, check=True, capture_output=True, text=True, timeout=PATIENCE_S).stdout
    steps = re.findall(r"\t(cli|sei|reti?|r?call|out\t0x3f|lds\tr\d+, 0x00(?:84|94))", listing)
    (timer3,) = [k for k, step in enumerate(steps) if step.endswith("94")]  # wherever the compiler has inlined it
    assert steps[timer3 - 2] == "cli"
    assert steps[timer3 - 1].endswith("84")  # no call in between, and no interrupt let in
    assert steps[timer3 + 1] == "out\t0x3f"
