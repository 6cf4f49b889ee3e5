# SPDX-License-Identifier: MIT
"""A Meshtastic node on a serial port: sends reports over its radio, and receives those of others.

In: reports; or payloads of the mesh. Out: packets for the node, by its serial API; or messages as a broker would bring them. Owns the port. The
package `meshtastic` is an optional part and GPL-3.0: it is loaded when a mesh:// address is used.

A wearer sends at most every `interval_s` (mesh_airtime.py), each time the newest report, and a new alarm at once. Packets are not passed on by other
nodes (hop limit 0): that would multiply the airtime. Meshtastic's own position message goes out too, less often, for the maps of its applications.
How often each of several wearers may send follows from the airtime of LoRa packets [Meshtastic, radio settings: modem presets].
"""

from __future__ import annotations

import math
import queue
import random
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple

from echostep.errors import EchostepError
from echostep.plan import Plan
from echostep_app.ports.port_faults import PORT_FAULTS
from echostep_app.team.endpoint import Endpoint
from echostep_app.team.mesh.mesh_report import MOST_NAMES, Unpacker, pack
from echostep_app.team.messages.report import Report, ReportedPlace, encode
from echostep_app.team.outbox import Delivery

INTERVAL_S = 10.0  # between two positions of a wearer where the airtime allows it
MOST_USED = 0.25  # share of the channel's time that all wearers together take [Meshtastic, polite channel utilization]
PREAMBLE = 16 + 4.25  # symbols of Meshtastic's preamble and of the synchronisation [AN1200.13]
OVERHEAD = 16 + 8  # bytes beside the payload: Meshtastic's packet header, and the fields of its Data message
SLOW_SYMBOL_S = 0.016  # longer symbols are sent with the low data rate optimisation [AN1200.13]


class Modem(NamedTuple):
    """Spreading factor, bandwidth in Hz, and the denominator of the coding rate 4/5 to 4/8."""

    spreading: int
    bandwidth_hz: float
    coding: int


PRESETS = {
    "SHORT_TURBO": Modem(7, 500e3, 5), "SHORT_FAST": Modem(7, 250e3, 5), "SHORT_SLOW": Modem(8, 250e3, 5),
    "MEDIUM_FAST": Modem(9, 250e3, 5), "MEDIUM_SLOW": Modem(10, 250e3, 5), "LONG_TURBO": Modem(11, 500e3, 8),
    "LONG_FAST": Modem(11, 250e3, 5), "LONG_MODERATE": Modem(11, 125e3, 8), "LONG_SLOW": Modem(12, 125e3, 8),
    "VERY_LONG_SLOW": Modem(12, 62.5e3, 8),
}  # fmt: skip

SLOWEST = PRESETS["LONG_SLOW"]  # of those in use: assumed for a preset that is not known


def airtime_s(modem: Modem, payload: int) -> float:
    """Seconds on air of a packet with `payload` bytes of payload, explicit header and checksum [Semtech, AN1200.13, 4]."""
    symbol_s = 2**modem.spreading / modem.bandwidth_hz
    slow = 2 if symbol_s > SLOW_SYMBOL_S else 0
    bits = 8 * (payload + OVERHEAD) - 4 * modem.spreading + 28 + 16
    blocks = max(math.ceil(bits / (4 * (modem.spreading - slow))), 0)
    return (PREAMBLE + 8 + blocks * modem.coding) * symbol_s


def interval_s(modem: Modem, payload: int, wearers: int) -> float:
    """Time between two positions of each wearer, so that all of them take at most MOST_USED of the channel."""
    return max(INTERVAL_S, wearers * airtime_s(modem, payload) / MOST_USED)


PRIVATE_APP = 256  # port of Meshtastic for applications of one's own
POSITION_EVERY = 6  # of our packets goes out as a position of Meshtastic's too
WEARERS = 20  # that share the channel where the address does not say how many: mesh:///dev/ttyUSB0?wearers=5
ANSWER_S = 30  # longest wait for the node's settings
EARLY = 0.1  # share of the interval by which a packet may go out earlier, so that wearers do not stay in step
MOST_WAITING = 1000  # packets that wait to be read


class MeshNode:
    """An open node: `send` a payload, `receive` those of others; every fault is an OSError."""

    def __init__(self, port: str) -> None:
        """Open the port and read the node's settings."""
        from meshtastic.mesh_interface import MeshInterface
        from meshtastic.serial_interface import SerialInterface
        from pubsub import pub

        self._packets: queue.Queue[bytes] = queue.Queue(MOST_WAITING)
        self._broken = False
        try:
            self._interface = SerialInterface(port, timeout=ANSWER_S)
        except (MeshInterface.MeshInterfaceError, *PORT_FAULTS) as error:
            raise ConnectionError(f"no Meshtastic node answers: {error}") from error
        pub.subscribe(self._received, "meshtastic.receive")
        pub.subscribe(self._lost, "meshtastic.connection.lost")
        self.number: int = self._interface.myInfo.my_node_num
        self.modem = _modem(self._interface.localNode.localConfig.lora)

    def send(self, data: bytes, port: int = PRIVATE_APP) -> None:
        """Give the node a packet for everybody."""
        if self._broken:
            raise ConnectionError("the connection to the node broke")
        try:
            self._interface.sendData(data, portNum=port, hopLimit=0)
        except (AttributeError, *PORT_FAULTS) as error:  # AttributeError: the package closed the port under a write
            raise ConnectionError(f"the connection to the node broke: {error}") from error

    def send_position(self, place: ReportedPlace, unix_s: float) -> None:
        """A position message of Meshtastic's own."""
        from meshtastic.protobuf.mesh_pb2 import Position
        from meshtastic.protobuf.portnums_pb2 import PortNum

        position = Position(
            latitude_i=round(1e7 * place.lat_deg), longitude_i=round(1e7 * place.lon_deg), time=int(unix_s),
            timestamp=int(unix_s), gps_accuracy=min(round(1e3 * place.sd_m), 2**31), precision_bits=32,
        )  # fmt: skip
        if place.course_deg is not None:
            position.ground_track = round(100.0 * place.course_deg)
        self.send(position.SerializeToString(), PortNum.POSITION_APP)

    def receive(self, timeout_s: float) -> bytes | None:
        """The next payload of another node; None after the timeout."""
        try:
            return self._packets.get(timeout=timeout_s)
        except queue.Empty:
            if self._broken:
                raise ConnectionError("the connection to the node broke") from None
            return None

    def close(self) -> None:
        """Close the port; raises nothing."""
        with suppress(Exception):  # a node that was unplugged
            self._interface.close()

    def _received(self, packet: dict[str, Any], interface: Any) -> None:
        decoded = packet.get("decoded", {})
        if (
            interface is self._interface
            and decoded.get("portnum") == "PRIVATE_APP"
            and packet.get("from") != self.number
        ):
            with suppress(queue.Full):
                self._packets.put_nowait(bytes(decoded.get("payload", b"")))

    def _lost(self, interface: Any) -> None:
        self._broken = self._broken or interface is self._interface


def _modem(lora: Any) -> Modem | None:
    """The modem of a node's settings; None for a preset without known figures, as newer firmware has."""
    if not lora.use_preset and lora.spread_factor:
        return Modem(lora.spread_factor, 1e3 * (lora.bandwidth or 250), max(lora.coding_rate, 5))
    known = lora.ModemPreset.DESCRIPTOR.values_by_number.get(lora.modem_preset)
    return PRESETS.get(known.name if known else "")


class MeshTransport:
    """A `Transport` to a node. Reports that come before the next packet is due are left out: a newer one will be there."""

    def __init__(self, endpoint: Endpoint, names: tuple[str, str], print_line: Callable[[str], None]) -> None:
        """`names` of team and wearer; raises EchostepError when they are too long."""
        if sum(len(name.encode()) for name in names) > MOST_NAMES:
            raise EchostepError(f"{endpoint}: --team and --name have more than {MOST_NAMES} bytes together")
        self._endpoint, self._print_line = endpoint, print_line
        self._node: MeshNode | None = None
        self._number, self._due_s, self._alarm = 0, -math.inf, (0, "")

    def open(self) -> None:
        """Connect to the node; raises OSError."""
        self._node = MeshNode(self._endpoint.host)
        if self._node.modem is None:
            self._print_line(
                f"{self._endpoint}: the node's modem preset is not known here: reports go out as seldom as by LONG_SLOW; "
                "pip install -U meshtastic, or set a preset as SHORT_FAST"
            )

    def send(self, report: Report) -> Delivery:
        """Send the report if a packet is due, or at once when it brings a new alarm; otherwise it is left out."""
        node = self._node
        if node is None:
            raise ConnectionError("not connected")
        alarm = (report.alarm.number, report.alarm.kind) if report.alarm else (0, "")
        now_s = time.monotonic()
        if now_s < self._due_s and alarm == self._alarm:
            return Delivery.LEFT_OUT
        payload = pack(report, self._number, time.time())
        wait_s = interval_s(node.modem or SLOWEST, len(payload), self._endpoint.wearers or WEARERS)
        if self._number == 0 and wait_s > INTERVAL_S:
            wearers = self._endpoint.wearers or WEARERS
            self._print_line(
                f"{self._endpoint}: this radio setting carries {wearers} wearers every {wait_s:.0f} s only: "
                "a faster modem preset (SHORT_FAST, SHORT_TURBO) carries more"
            )
        node.send(payload)
        if self._number % POSITION_EVERY == 0 and report.place is not None:
            node.send_position(report.place, time.time())
        self._number, self._alarm = self._number + 1, alarm
        self._due_s = now_s + wait_s * random.uniform(1.0 - EARLY, 1.0)
        return Delivery.SENT

    def close(self, *, ended: bool) -> None:  # noqa: ARG002
        """Close the port."""
        node, self._node = self._node, None
        if node is not None:
            node.close()


class MeshListener:
    """A subscription like that to a broker: each report of the mesh goes to `put(topic, payload, retained)`, as JSON."""

    def __init__(
        self, endpoint: Endpoint, team: str | None, plan: Plan, put: Callable[[str | None, bytes, bool], None]
    ) -> None:
        """`team`: only this one."""
        self._endpoint, self._team, self._put = endpoint, team, put
        self._unpacker = Unpacker(plan)
        self._node: MeshNode | None = None

    def open(self) -> str:
        """Connect to the node; raises OSError."""
        self._node = MeshNode(self._endpoint.host)
        return ""

    def run_once(self, timeout_s: float) -> None:
        """Wait for one packet and pass it on; raises OSError when the connection is broken."""
        if self._node is None:
            raise ConnectionError("not connected")
        payload = self._node.receive(timeout_s)
        if payload is None:
            return
        try:
            report = self._unpacker.unpack(payload)
        except ValueError:
            self._put("mesh", payload, False)  # counted among what is not believed
            return
        if self._team in (None, report.team):
            self._put(f"echostep/{report.team}/{report.name}/estimate", encode(report), False)

    def publish(self, topic: str, payload: bytes) -> None:
        """Raises OSError: a mesh keeps no messages."""
        raise ConnectionError(f"{topic}: {len(payload)} bytes cannot be kept by a mesh")

    def close(self) -> None:
        """Close the port; raises nothing."""
        node, self._node = self._node, None
        if node is not None:
            node.close()
