# SPDX-License-Identifier: MIT
"""The kind of a file that is no recording, and the command that reads it.

In: a path. Out: one sentence; "" for an MCAP file. Owns nothing. The first bytes decide, and of a table the names of its columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from echostep.errors import EchostepError, replaced
from echostep.offline import imu_csv
from echostep.offline.csv_table import LONGEST_LINE, UTF_16, header_of
from echostep.ports.chunks import BOARD
from echostep.recording import MCAP_MAGIC, SUFFIX, port_of_bytes
from echostep_app.offline import leg_csv
from echostep_app.offline.foreign_columns import read_header
from echostep_app.printing.lines import as_error

HEAD = 1 << 16  # bytes that are looked at
PACKETS = (
    "packets of a network or of USB: take the port's bytes out of it, then echostep decode reads them: "
    "tshark -r FILE -T fields -e usb.capdata -e udp.payload | xxd -r -p > port.bin"
)
PICTURE = "a picture: where it is that of a plan, echostep plan edit PLAN --picture FILE draws over it"
BEGINNINGS = {  # of files [their specifications; file(1)]
    b"\xd4\xc3\xb2\xa1": PACKETS, b"\xa1\xb2\xc3\xd4": PACKETS, b"\x4d\x3c\xb2\xa1": PACKETS, b"\xa1\xb2\x3c\x4d": PACKETS,  # pcap
    b"\x0a\x0d\x0d\x0a": PACKETS,  # pcapng
    b"\x89PNG": PICTURE, b"\xff\xd8\xff": PICTURE,
    b"%PDF": "a PDF: echostep plan import FILE says how it becomes a plan",
    b"SQLite format 3": "a database (SQLite), as of a GeoPackage or a bag of ROS 2: echostep import FILE -o walk.mcap reads a bag",
    b"#ROSBAG V2": "a bag of ROS 1: convert it (mcap convert FILE OUT.mcap)",
}  # fmt: skip
TABLES = {  # columns that such a table has, and what it is
    imu_csv.COLUMNS: "samples of a foot: echostep foot FILE tracks them",
    leg_csv.COLUMNS: "samples of a leg: echostep legs FILE tracks them",
    leg_csv.AXES["thigh_rad_s"]: "samples of a leg: echostep legs FILE tracks them",
    ("t_s", "pressure_pa"): "samples of a barometer: echostep floors FILE finds the storeys",
    ("x_m", "y_m"): "a track: echostep score FILE --truth TRUTH compares it with the truth",
    ("x", "y"): "a track: echostep score FILE --truth TRUTH compares it with the truth",
}
MOST_NAMES = 12  # columns that are named


def refuse_foreign(paths: Sequence[Path]) -> None:
    """Raises EchostepError for a table, which `import` reads."""
    for path in paths:
        if path.is_file() and path.suffix.casefold() != SUFFIX and (what := foreign(path)).startswith("a table"):
            raise EchostepError(
                f"{path}: no recording but {what}; echostep import {path} -o walk.mcap makes one of a foot's samples"
            )


def foreign(path: Path) -> str:
    """A sentence about a file that is no MCAP file; raises EchostepError when it cannot be read."""
    if path.is_dir():
        return "a folder: give one file of it"
    with as_error(f"{path}: cannot read the recording"), path.open("rb") as file:
        head = file.read(HEAD)
    if head.startswith(MCAP_MAGIC):
        return ""
    if not head:
        return "an empty file"
    said = next((said for beginning, said in BEGINNINGS.items() if head.startswith(beginning)), "")
    return (said or replaced(head) or _of_bytes(path) or _of_text(head)).replace("FILE", str(path))


def _of_bytes(path: Path) -> str:
    """Of a file in which frames of a board or of an MT are."""
    port = port_of_bytes(path)
    if port is None:
        return ""
    return f"bytes of {'the board' if port == BOARD else 'an MT'}'s port: echostep decode FILE prints their messages"


def _of_text(head: bytes) -> str:
    """Of a text, by its first line."""
    try:
        text = head.decode("utf-8-sig" if not head.startswith(UTF_16) else "utf-16")
    except UnicodeDecodeError as error:
        text = "" if error.end < len(head) - 3 else head[: error.start].decode("utf-8-sig")
    if not text.isprintable() and any(c not in "\t\r\n\f" and not c.isprintable() for c in text[:LONGEST_LINE]):
        text = ""
    if not text:
        return "bytes of an unknown kind: neither frames of a board or an MT, nor a text"
    if text.lstrip().startswith(("{", "[", "<")):
        return f"{'JSON' if text.lstrip()[0] != '<' else 'XML'}: where it is a plan, echostep plan check FILE or echostep plan import FILE reads it"
    lines = text.splitlines(keepends=True)
    names, _ = header_of(lines[0][:LONGEST_LINE])
    small = {name.casefold() for name in names}
    with suppress(ValueError, EchostepError):  # of a program whose names `import` knows
        small |= set(read_header(iter(lines)).names)
    for columns, said in TABLES.items():
        if small.issuperset(columns):
            return f"a table with {said}"
    if len(names) < 2:
        return "a text that no command reads"
    shown = ", ".join(name[:20] or "-" for name in names[:MOST_NAMES])
    return f"a table whose columns no command knows ({shown}): the manual's pages of foot, legs, floors and score name theirs"
