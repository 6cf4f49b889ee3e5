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

GUIDE = (ROOT / "firmware/README.md").read_text()
BENCH = (ROOT / "firmware/bench.md").read_text()
TWIN = ROOT / "tools/twin"
PLACE = re.compile(r"chapters? \d|table \d|pages? \d")
MARK = re.compile(r"\*unverified, \[bench (\d+)\]\(bench\.md\)\*")


def test_each_unverified_statement_names_its_measurement_and_each_measurement_settles_one() -> None:
    definition = "are marked *unverified*, with"
    assert definition in GUIDE
    assert len(re.findall("unverified", GUIDE, flags=re.I)) == len(MARK.findall(GUIDE)) + 1  # none without a number
    numbers = {str(n) for n in range(1, 16)}
    assert set(MARK.findall(GUIDE)) == numbers
    assert set(re.findall(r"^\| .+ \| (\d+) \|$", BENCH, flags=re.M)) == numbers
    assert set(re.findall(r"^## (\d+)\. ", BENCH, flags=re.M)) == numbers


def test_each_model_cites_a_place_or_stands_in_the_list_from_memory() -> None:
    page = (TWIN / "README.md").read_text()
    memory = page.partition("## From memory")[2].partition("\n## ")[0]
    sources = dict[str, str]()
    for names, source in re.findall(r"^\| (`\w+/.+?) \| .* \| (.+) \|$", page, flags=re.M):
        sources |= dict.fromkeys(re.findall(r"`(\w+/\w+\.c)`", names), source)
    files = {str(path.relative_to(TWIN)) for folder in ("mcu", "parts", "usb") for path in (TWIN / folder).glob("*.c")}
    assert sources.keys() == files
    for name, source in sources.items():
        assert source == "-" or PLACE.search(source) or f"`{name}`" in memory or "nets of" in source, name


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
