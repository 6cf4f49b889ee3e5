# SPDX-License-Identifier: MIT
"""Entry points for bytes into the host, for `host.py`: for each a valid input, and the function that takes it.

In: nothing. Out: `TARGETS`. Owns nothing. A target may raise EchostepError, and ValueError where its docstring says so; anything else is a fault.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from echostep.board.frames import encode
from echostep.board.gateway import Gateway
from echostep.plan import load_plan, parse_plan
from echostep.ports.chunks import BOARD, MTX, Chunk, portion_of
from echostep.ports.people.check_in import parse_person
from echostep.recording import open_recording
from echostep.settings import parse_settings
from echostep.tracker import Tracker
from echostep.xsens import MTDATA, MTDATA2, PROJECT, MtSample, MtxLimits, MtxReader, encode_frame
from echostep.xsens.frames import MAX_LENGTH
from echostep.xsens.message import MessageReader
from echostep.xsens.packets import read_packets
from echostep_app.offline.floors.pressure_csv import load_pressures
from echostep_app.offline.foot_files import load_foot
from echostep_app.offline.leg_csv import load_legs
from echostep_app.page.requests import parse_request
from echostep_app.plan.importers.formats import import_plan
from echostep_app.ports.datagram_key import Opener, seal
from echostep_app.recording.recorder import Recorder
from echostep_app.recording.repair.recovery import Recovery
from echostep_app.team.messages.report import decode
from echostep_app.team.messages.report import encode as report_bytes
from echostep_app.xsens.requests import project_requests
from echostep_app.xsens.setup import MtxSetup
from echostep_simulation.devices.beacon_gateway import message
from echostep_simulation.devices.mtx_formats import pack
from plan import test_plan_importer_imdf as imdf
from team.team_reports import report
from walks import DEMO, walk_chunks

KEY = bytes(range(32))
UNITS = "unit.geojson"  # of a venue
SAMPLE = MtSample(0, (0.5, -0.25, 9.75), (0.125, 0.0, -1.5), (0.5, 0.0, -0.875), (0.5, 0.5, -0.5, 0.5))
MTDATA_BYTES = pack(SAMPLE, PROJECT)  # an MTData message is as long as that, or is none
PLAN = """{"echostep_plan":1,"name":"p","levels":[{"name":"g","height_m":0,"walls":[[0,0,4,0],[4,0,4,4],[4,4,0,4],[0,4,0,0]],
"rooms":[{"name":"r","at":[1,1],"outline":[[0,0],[2,0],[2,2]]}],"doors":[{"line":[1,0,2,0]}],"obstacles":[[[1,1],[2,1],[2,2]]]}],
"start":{"x":0.5,"y":0.5,"heading_deg":0},"georeference":{"origin":[8,53]},"uncertainty_m":0.1}"""
OSM = """<osm><node id="1" lat="53.1" lon="8.8"/><node id="2" lat="53.1001" lon="8.8"/><node id="3" lat="53.1001" lon="8.8002"/>
<node id="4" lat="53.1" lon="8.8002"/><way id="9"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="4"/><nd ref="1"/>
<tag k="indoor" v="room"/><tag k="level" v="0"/><tag k="name" v="Hall"/></way></osm>"""


@dataclass(frozen=True, slots=True)
class Target:
    """A valid input, and a function that takes any bytes."""

    seed: Callable[[], bytes]
    take: Callable[[bytes], object]


@cache
def tracker() -> Tracker:
    """One tracker for all inputs: what one leaves behind must not harm the next."""
    return Tracker(load_plan(DEMO), None, None, 1)


def port(name: str) -> Callable[[bytes], object]:
    """The tracker's own port: bytes as one chunk, half a second after the one before."""
    arrivals = iter(range(0, 1 << 62, 500_000_000))
    return lambda data: tracker().take(portion_of([Chunk(name, next(arrivals), data)]))


def bytes_of(name: str) -> bytes:
    """The first bytes of a port in the demo."""
    return b"".join(chunk.data for chunk in walk_chunks(15.0) if chunk.port == name)[:400]


def packets() -> bytes:
    """The payload of an MTData2 message: counter; quaternion, accel and gyro in float32, fixed point 12.20 and float64."""
    payload = b"\x10\x20\x02\0\0"
    for identifier, values, form, scale in (
        (0x2010, SAMPLE.quaternion, ">f4", 1),
        (0x4021, SAMPLE.accel, ">i4", 1 << 20),
        (0x8023, SAMPLE.gyro, ">f8", 1),
    ):
        content = (np.array(values) * scale).astype(form).tobytes()
        payload += identifier.to_bytes(2, "big") + bytes([len(content)]) + content
    return payload


def measure(identifier: int, payload: bytes) -> None:
    """Have an MTx's reader take a message whose checksum is right: only samples within the limits may pass."""
    limits, batch = MtxLimits(), MtxReader().feed_batch(encode_frame(identifier, payload))
    quaternion = batch.quaternion[~np.isnan(batch.quaternion).all(axis=1)]
    mag = batch.mag[~np.isnan(batch.mag).all(axis=1)]
    assert np.all(np.abs(batch.accel) <= limits.accel_m_s2), "accel"
    assert np.all(np.abs(batch.gyro) <= limits.gyro_rad_s), "gyro"
    assert np.all(np.abs(mag) <= limits.mag), "mag"
    assert np.all(np.abs(np.linalg.norm(quaternion, axis=1) - 1.0) <= limits.quaternion_error + 1e-12), "quaternion"
    assert np.all((batch.counter >= 0) & (batch.counter < 1 << 16)), "counter"


def file(name: str, read: Callable[[Path], object]) -> Callable[[bytes], object]:
    """Have a function read the bytes from a file of this name."""

    def take(data: bytes) -> object:
        with TemporaryDirectory(dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as folder:
            (Path(folder) / name).write_bytes(data)
            return read(Path(folder) / name)

    return take


def recording() -> bytes:
    """A small recording."""
    with TemporaryDirectory() as folder:
        with Recorder(Path(folder) / "a.mcap", {"seed": "1", "start_x_y_rad": "1,2,0"}) as recorder:
            for k in range(12):
                recorder.write(Chunk(BOARD if k % 2 else MTX, k * 10_000_000, bytes(range(k, k + 20))))
        return (Path(folder) / "a.mcap").read_bytes()


def read_recording(path: Path) -> None:
    """Read it as a replay does, and as repair does."""
    list(open_recording(path).portions())
    list(Recovery(path).messages())


def written(write: Callable[[Path], Path]) -> Callable[[], bytes]:
    """The bytes of a file that a function writes into a folder."""

    def read() -> bytes:
        with TemporaryDirectory() as folder:
            return write(Path(folder)).read_bytes()

    return read


def write_drawing(folder: Path) -> Path:
    """A room with a door's swing and a name, in metres."""
    from ezdxf.filemanagement import new

    drawing = new(units=6)
    space = drawing.modelspace()
    space.add_lwpolyline([(0, 0), (4, 0), (4, 4), (0, 4)], close=True, dxfattribs={"layer": "Walls"})
    space.add_arc((1, 0), 0.9, 0, 90, dxfattribs={"layer": "Doors"})
    space.add_text("Hall", dxfattribs={"layer": "Rooms", "insert": (2, 2)})
    drawing.saveas(folder / "a.dxf")
    return folder / "a.dxf"


def write_model(folder: Path) -> Path:
    """A house of two storeys with a door, a window and stairs."""
    from plan.test_plan_importer_ifc import write_house  # needs ifcopenshell

    return write_house(folder)


def import_units(data: bytes) -> object:
    """Import a venue with these bytes as its units."""
    with TemporaryDirectory() as folder:
        venue = imdf.folder(Path(folder), imdf.files())
        (venue / UNITS).write_bytes(data)
        return import_plan(venue)


def csv(header: str, *columns: float, rate_hz: float = 100.0) -> Callable[[], bytes]:
    """A table of 150 rows: sines about each of these values."""
    rows = [
        ",".join([f"{k / rate_hz:.2f}", *(f"{mean + math.sin(0.07 * k + n):.3f}" for n, mean in enumerate(columns))])
        for k in range(150)
    ]
    return "\n".join([header, *rows]).encode


def text(read: Callable[[str], object]) -> Callable[[bytes], object]:
    """Have a function read the bytes as text."""
    return lambda data: read(data.decode("utf-8", "replace"))


TARGETS: dict[str, Target] = {
    "board": Target(lambda: bytes_of(BOARD), port(BOARD)),
    "mtx": Target(lambda: bytes_of(MTX), port(MTX)),
    "xbus": Target(lambda: bytes_of(MTX), lambda data: MessageReader().feed(data, ended=True)),
    "mtdata": Target(
        lambda: MTDATA_BYTES, lambda data: measure(MTDATA, data[: len(MTDATA_BYTES)].ljust(len(MTDATA_BYTES), b"\0"))
    ),
    "mtdata2": Target(packets, lambda data: measure(MTDATA2, data[:MAX_LENGTH])),
    "packets": Target(packets, read_packets),
    "setup": Target(lambda: bytes_of(MTX), lambda data: MtxSetup(project_requests(100.0), 100.0).advance(data, 0.0)),
    "gateway": Target(lambda: encode(message(7, 3.0, 0.5, 10.0), 0) * 3, lambda data: Gateway().read(data, 10.0)),
    "datagram": Target(lambda: seal(KEY, b"frames", 1), Opener(KEY).open),
    "person": Target(lambda: b'{"x_m":1.0,"y_m":2.0,"level":0,"sd_m":0.5}', parse_person),
    "websocket": Target(lambda: b'{"kind":"go_to","x_m":1.0,"y_m":2.0,"level":0}', text(parse_request)),
    "mqtt": Target(lambda: report_bytes(report()), decode),
    "settings": Target(lambda: b"[cloud]\nsize = 300\n[mtx]\nrate_hz = 100\n", text(lambda t: parse_settings(t, "x"))),
    "plan": Target(PLAN.encode, parse_plan),
    "mcap": Target(recording, file("a.mcap", read_recording)),
    "dxf": Target(written(write_drawing), file("a.dxf", import_plan)),
    "osm": Target(OSM.encode, file("a.osm", import_plan)),
    "imdf": Target(written(lambda folder: imdf.folder(folder, imdf.files()) / UNITS), import_units),
    "ifc": Target(written(write_model), file("a.ifc", import_plan)),
    "legs": Target(csv("t_s,thigh_rad_s,shank_rad_s", 0.0, 0.1), file("a.csv", load_legs)),
    "imu": Target(csv("t_s,ax,ay,az,gx,gy,gz", 0.0, 0.0, 9.8, 0.0, 0.0, 0.0), file("a.csv", load_foot)),
    "pressure": Target(csv("t_s,pressure_pa", 101_325.0, rate_hz=10.0), file("a.csv", load_pressures)),
}
ALLOWED = {
    "plan": (ValueError,),
    "mqtt": (ValueError,),
    "packets": (ValueError,),
}  # besides EchostepError: their callers turn it into words
