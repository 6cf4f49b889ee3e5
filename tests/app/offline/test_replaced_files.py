# SPDX-License-Identifier: MIT
"""A packed file, or a pointer of Git LFS, in place of a table, a recording or a plan is named, with the next step."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import zipfile
from pathlib import Path

import pytest

from command_line import echostep

TABLE = b"t_s,ax,ay,az,gx,gy,gz\n0,0,0,9.8,0,0,0\n" * 9


POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a214614ab2935c943f9e0ff69d22e\nsize 12345\n"


def zipped() -> bytes:
    with zipfile.ZipFile(file := io.BytesIO(), "w") as archive:
        archive.writestr("imu.csv", TABLE)
    return file.getvalue()


KINDS = {
    "gzip": (gzip.compress(TABLE), "packed by gzip: unpack it first"),
    "bzip2": (bz2.compress(TABLE), "packed by bzip2: unpack it first"),
    "xz": (lzma.compress(TABLE), "packed by xz: unpack it first"),
    "zip": (zipped(), "packed by zip: unpack it first"),
    "pointer": (POINTER, "a pointer of Git LFS in place of the file: git lfs pull brings it"),
}


@pytest.mark.parametrize("kind", list(KINDS))
@pytest.mark.parametrize(
    "command",
    [("foot", "a"), ("legs", "a"), ("floors", "a", "--heights", "0,3"), ("replay", "a"), ("plan", "check", "a"), ("score", "a", "--truth", "a")],
    ids=" ".join,
)  # fmt: skip
def test_the_kind_and_the_next_step_are_named(tmp_path: Path, command: tuple[str, ...], kind: str) -> None:
    content, said = KINDS[kind]
    (tmp_path / "a").write_bytes(content)
    done = echostep(*command, cwd=tmp_path)
    if (command[0], kind) == ("foot", "zip"):  # which is read, as phones write it
        assert done.stderr == "echostep: a: imu.csv: t_s does not advance\n"
        return
    assert (done.returncode, done.stderr) == (2, f"echostep: a: {said}\n"), done.stdout
    assert said in echostep("info", "a", cwd=tmp_path).stdout + echostep("info", "a", cwd=tmp_path).stderr
