# SPDX-License-Identifier: MIT
"""The firmware's own C, compiled for this machine with its sanitizers: every golden vector, hostile bytes; builds and atomic reads."""

from __future__ import annotations

import configparser
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from board_runs import ELF, ROOT, needs_twin
from reliability.fuzz import codec as fuzz_codec
from waiting import PATIENCE_S, ran

FIRMWARE = ROOT / "firmware"
CODEC = [FIRMWARE / name for name in ("cobs.c", "frame.c", "messages.c")]
FLAGS = ["-std=c11", "-O1", "-g", "-Wall", "-Wextra", "-Werror", f"-I{FIRMWARE}", "-fno-sanitize-recover=all"]
HOST_MESSAGES = ("identify", "clock_query", "configure", "check_gyros", "subscribe")
TIMEOUT_S = 600  # reached only by a program that hangs
pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
PROLOGUE = """
#include <stdio.h>
#include <string.h>
#include "frame.h"
static int failures;
static void hold(int line, int condition)
{
	if (!condition) {
		printf("vector %d\\n", line);
		failures++;
	}
}
static void same(int line, const void *found, long found_length, const void *wanted, long wanted_length)
{
	hold(line, found_length == wanted_length && !memcmp(found, wanted, (size_t)wanted_length));
}
static unsigned char out[600], payload[600];
"""


def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
    return ran([str(c) for c in command], timeout=TIMEOUT_S)


def build(program: Path, compiler: str, sources: list[Path], *flags: str) -> Path:
    done = run(compiler, *FLAGS, *flags, "-o", program, *sources)
    assert done.returncode == 0, done.stderr
    return program


def array(hexadecimal: str) -> str:
    return "(const unsigned char[]){" + ", ".join(str(b) for b in bytes.fromhex(hexadecimal) or b"\0") + "}"


def cobs_case(line: int, vector: dict[str, Any]) -> str:
    plain, encoded = vector["plain"], vector["encoded"]
    return f"""
	same({line}, out, cobs_encode(out, {array(plain)}, {len(plain) // 2}), {array(encoded)}, {len(encoded) // 2});
	same({line}, out, cobs_decode(out, {array(encoded)}, {len(encoded) // 2}), {array(plain)}, {len(plain) // 2});"""


def sent_case(line: int, name: str, vector: dict[str, Any]) -> str:
    """A message of the board: packed, numbered, checksummed and stuffed."""
    values = ", ".join(f".{field} = {value}" for field, value in vector["fields"].items())
    return f"""
	n = msg_pack_{name}(payload + FRAME_HEAD_SIZE, &(struct msg_{name}){{ {values} }});
	n = frame_encode(out, payload, MSG_{name.upper()}, {vector["sequence"]}, (unsigned char)n);
	same({line}, out, n, {array(vector["frame"])}, {len(vector["frame"]) // 2});"""


def received_case(line: int, name: str, vector: dict[str, Any]) -> str:
    """A message of the host: unstuffed, checked and unpacked."""
    length = len(vector["frame"]) // 2 - 1
    code = f"""
	memcpy(payload, {array(vector["frame"])}, {length});
	n = frame_decode(payload, {length});
	hold({line}, n >= 0 && n <= MSG_{name.upper()}_SIZE && payload[0] == MSG_{name.upper()});"""
    if not vector["fields"]:
        return code
    fields = " ".join(f"hold({line}, m.{field} == {value});" for field, value in vector["fields"].items())
    return f"""{code}
	{{
		struct msg_{name} m;
		hold({line}, msg_unpack_{name}(&m, payload + FRAME_HEAD_SIZE, (unsigned char)n));
		{fields}
	}}"""


def case(line: int, vector: dict[str, Any]) -> str:
    if "cobs" in vector:
        return cobs_case(line, vector)
    name = vector["message"]
    return received_case(line, name, vector) if name in HOST_MESSAGES else sent_case(line, name, vector)


@pytest.mark.process
def test_every_vector(tmp_path: Path) -> None:
    lines = (ROOT / "protocol" / "vectors.jsonl").read_text().splitlines()
    cases = [
        case(number, json.loads(line)) for number, line in enumerate(lines, 1) if '"message": "beacon"' not in line
    ]
    full = "01" * 254  # a last block of 254 bytes, with and without the empty block that none need send
    cases.append(f"same(0, out, cobs_decode(out, {array('ff' + full + '01')}, 256), {array(full)}, 254);")
    assert {"cobs": "ones", "plain": full, "encoded": "ff" + full} in map(json.loads, lines)
    source = tmp_path / "vectors.c"
    source.write_text(f"{PROLOGUE}int main(void)\n{{\n\tlong n;{''.join(cases)}\n\treturn failures != 0;\n}}\n")
    done = run(build(tmp_path / "vectors", "cc", [source, *CODEC], "-O0", "-fsanitize=address,undefined"))
    assert done.returncode == 0, done.stdout + done.stderr
    assert len(cases) > 80


@pytest.mark.process
@pytest.mark.skipif(shutil.which("clang") is None, reason="no clang, so no libFuzzer")
def test_coverage_guided_hostile_bytes(tmp_path: Path) -> None:
    """A small shard of `make fuzz`, from its corpus."""
    program = fuzz_codec.build(tmp_path / "fuzz")
    corpus = fuzz_codec.unpack(tmp_path / "corpus")
    done = fuzz_codec.fuzz(program, corpus, 1, "-runs=50000", f"-artifact_prefix={tmp_path}/")
    assert done.returncode == 0, done.stderr[-2000:]
    assert fuzz_codec.executions(done.stderr) >= 50_000


@pytest.mark.process
@pytest.mark.skipif(shutil.which("clang") is None, reason="no clang, so no libFuzzer")
def test_the_whole_firmware_on_a_hostile_board(tmp_path: Path) -> None:
    """A small shard of the second half of `make fuzz`."""
    (corpus := tmp_path / "corpus").mkdir()
    program = fuzz_codec.build(tmp_path / "whole", fuzz_codec.WHOLE)
    limits = "-runs=5000", f"-artifact_prefix={tmp_path}/"
    done = fuzz_codec.fuzz(program, corpus, 1, *limits, longest=fuzz_codec.WHOLE_LONGEST)
    assert done.returncode == 0, done.stderr[-2000:]
    assert fuzz_codec.executions(done.stderr) >= 5_000


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
