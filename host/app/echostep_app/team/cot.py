# SPDX-License-Identifier: MIT
"""Cursor on Target: a report as an event for TAK, over UDP, TCP or TLS.

In: reports with a position on Earth. Out: `event` elements [CoT Event 2.0 schema, MITRE], one per datagram, or one after the other on a
stream. Owns one socket, used by one thread. XML is made by the standard library; pytak is not used, because its client queues events, and
the newest position must go first.

`ce` and `le` follow the schema: one standard deviation, `ce` along the direction of the largest variance, the plan's uncertainty included.
The remarks contain the 95 % radius. `start` is when the position was recorded, in a replay; `time` is when it was sent.
"""

from __future__ import annotations

import ipaddress
import math
import socket
import ssl
from contextlib import suppress
from uuid import NAMESPACE_URL, uuid5
from xml.etree import ElementTree

from echostep_app.team.endpoint import Endpoint
from echostep_app.team.faults import ENDED, opening_words
from echostep_app.team.messages.report import Report, ReportedAlarm, ReportedPlace
from echostep_app.team.outbox import Delivery
from echostep_app.team.tls import tls_context
from echostep_app.wearer.steady_status import late_words, span_words

FRIEND_ON_FOOT = "a-f-G-U-C"  # friendly, ground, unit, combat
EMERGENCY, EMERGENCY_OVER = "b-a-o-tbl", "b-a-o-can"  # alarm, other: ATAK's "911 Alert" and its cancelling
UNKNOWN = "9999999.0"  # value of `hae`, `ce` and `le` when they are not known [CoT Event 2.0 schema]
HOW = {"live": "m-f", "replay": "m-r", "simulated": "m-s"}  # made by a machine: fused now, relayed, simulated [schema]
SOCKET_TIMEOUT_S = 3.0  # for connecting and for sending
GROUPS = {
    "White", "Yellow", "Orange", "Magenta", "Red", "Maroon", "Purple",
    "Dark Blue", "Blue", "Cyan", "Teal", "Green", "Dark Green", "Brown",
}  # names of the team colours that TAK shows  # fmt: skip
MULTICAST_HOPS = 4


def event(report: Report) -> bytes | None:
    """A report as an event, one line of XML in UTF-8; None when it has no position on Earth."""
    place, position, motion = report.place, report.position, report.motion
    if place is None or position is None:
        return None
    top = _begun(report, place, uid(report.team, report.name), FRIEND_ON_FOOT)
    detail = ElementTree.SubElement(top, "detail")
    ElementTree.SubElement(detail, "contact", callsign=report.name)
    if motion is not None and place.course_deg is not None:
        track = {"course": f"{round(place.course_deg, 1) % 360.0:.1f}", "speed": f"{motion.speed_m_s:.2f}"}
        ElementTree.SubElement(detail, "track", track)
    if report.battery_percent is not None:
        ElementTree.SubElement(detail, "status", battery=str(report.battery_percent))
    if report.team.title() in GROUPS:
        ElementTree.SubElement(detail, "__group", name=report.team.title(), role="Team Member")
    ElementTree.SubElement(detail, "precisionlocation", geopointsrc="CALC", altsrc="CALC" if place.hae_m else "???")
    ElementTree.SubElement(detail, "takv", platform="echostep", version=report.version, device="", os="")
    ElementTree.SubElement(detail, "remarks").text = remarks(report)
    return ElementTree.tostring(top, encoding="utf-8", xml_declaration=False)


def events(report: Report) -> list[bytes]:
    """The event of a report with a position on Earth, and the event of its emergency, if any."""
    return [made for made in (event(report), emergency(report)) if made is not None]


def emergency(report: Report) -> bytes | None:
    """A mayday as TAK's emergency, or its end; None without a mayday. It goes out without a position on Earth too: its point is then unknown.

    The form is ATAK's: uid of the wearer and "-9-1-1", a link to the wearer, `emergency` in the detail.
    """
    alarm, place = report.alarm, report.place
    if alarm is None or alarm.kind == "asking":
        return None
    over = alarm.kind == "over"
    of, kind = uid(report.team, report.name), EMERGENCY_OVER if over else EMERGENCY
    top = _begun(report, place, f"{of}-9-1-1", kind)
    detail = ElementTree.SubElement(top, "detail")
    ElementTree.SubElement(detail, "link", uid=of, type=FRIEND_ON_FOOT, relation="p-p")
    ElementTree.SubElement(detail, "contact", callsign=f"{report.name}-Alert")
    says = {"cancel": "true"} if over else {"type": "911 Alert"}
    ElementTree.SubElement(detail, "emergency", says).text = report.name
    ElementTree.SubElement(detail, "remarks").text = remarks(report)
    return ElementTree.tostring(top, encoding="utf-8", xml_declaration=False)


def uid(team: str, name: str) -> str:
    """Unique identifier of a wearer; a part of a hash is appended when a hyphen in a name makes it ambiguous."""
    plain = f"echostep-{team}-{name}"
    return plain if plain.count("-") == 2 else f"{plain}-{uuid5(NAMESPACE_URL, f'{team}/{name}').hex[:8]}"


def remarks(report: Report) -> str:
    """Status, 95 % radius, room and floor (of a lost wearer the last known ones), age, and other facts for which the event has no field."""
    p = report.position
    words = [f"{report.status}, 95 % within {p.radius95_m:.1f} m" if p else f"{report.status}, place not known"]
    if report.alarm:
        words.insert(0, alarm_words(report.alarm))
    if p:
        words.append(", ".join(filter(None, (p.where, p.floor_name))))
        words += filter(None, [late_words(p.age_s)])
    elif last := report.last_place:
        known = f"last known {span_words(last.age_s)} ago"
        words.append(", ".join(filter(None, (known, last.where, last.floor_name))))
    if report.motion:
        words.append(f"still for {report.motion.still_s:.0f} s")
    words.append(f"team {report.team}")
    if report.source != "live":
        words.append(report.source)
    if report.recorded:
        words.append(f"recorded {report.recorded}")
    return "; ".join(words)


def alarm_words(alarm: ReportedAlarm) -> str:
    """An alarm in words: "mayday: no motion for 34 s", "mayday: fall 14 s ago"."""
    if alarm.kind == "over":
        return f"mayday over for {alarm.age_s:.0f} s"
    kind = "asked whether all is well" if alarm.kind == "asking" else "mayday"
    age = span_words(alarm.age_s)
    why = {"no motion": f"no motion for {age}", "fall": f"fall {age} ago", "help": f"asked for help {age} ago"}
    return f"{kind}: {why[alarm.reason]}"


def _begun(report: Report, place: ReportedPlace | None, of: str, kind: str) -> ElementTree.Element:
    """An event of this uid and type with its times and its point."""
    top = ElementTree.Element("event", version="2.0", uid=of, type=kind)
    top.attrib |= {
        "time": report.time,
        "start": report.recorded or report.time,
        "stale": report.stale,
        "how": HOW[report.source],
    }
    ElementTree.SubElement(top, "point", _point(place))
    return top


def _point(place: ReportedPlace | None) -> dict[str, str]:
    """Attributes of a `point`; None: one that is not known, as ATAK sends it without a fix."""
    if place is None:
        return {"lat": "0.0", "lon": "0.0", "hae": UNKNOWN, "ce": UNKNOWN, "le": UNKNOWN}
    hae, le = (UNKNOWN if v is None else f"{v:.2f}" for v in (place.hae_m, place.hae_sd_m))
    lat, lon = f"{place.lat_deg:.8f}", f"{place.lon_deg:.8f}"
    # Rounded up, so that no error is written smaller than it is
    return {"lat": lat, "lon": lon, "hae": hae, "ce": f"{math.ceil(place.sd_m * 100.0) / 100.0:.2f}", "le": le}


class UdpTransport:
    """A `Transport` of datagrams, to a host or to a multicast group (TAK: 239.2.3.1:6969)."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._socket: socket.socket | None = None

    def open(self) -> None:
        """Resolve the host and make a socket."""
        family, kind, number, _, address = _address(self._endpoint, socket.SOCK_DGRAM)
        self._socket = socket.socket(family, kind, number)
        self._socket.setblocking(False)
        if ipaddress.ip_address(address[0].partition("%")[0]).is_multicast:
            level, option = (
                (socket.IPPROTO_IPV6, socket.IPV6_MULTICAST_HOPS)
                if family == socket.AF_INET6
                else (socket.IPPROTO_IP, socket.IP_MULTICAST_TTL)
            )
            self._socket.setsockopt(level, option, MULTICAST_HOPS)
        self._socket.connect(address)

    def send(self, report: Report) -> Delivery:
        """Send a datagram for each event; one to an unreachable port is left out, since the receiver may start later."""
        if self._socket is None:
            raise ConnectionError("not connected")
        delivery = Delivery.LEFT_OUT
        for made in events(report):
            with suppress(ConnectionRefusedError, BlockingIOError):
                self._socket.send(made)
                delivery = Delivery.SENT
        return delivery

    def close(self, *, ended: bool) -> None:  # noqa: ARG002
        """Close the socket."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


class StreamTransport:
    """A `Transport` of events on TCP or TLS, to a TAK server."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._tls = tls_context(endpoint) if endpoint.secure else None
        self._socket: socket.socket | None = None

    def open(self) -> None:
        """Connect, with the TLS handshake for cot+tls."""
        plain = socket.create_connection((self._endpoint.host, self._endpoint.port), SOCKET_TIMEOUT_S)
        try:
            plain.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            # Bytes; small, because events in the buffer get outdated
            plain.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 16_384)
            self._socket = self._tls.wrap_socket(plain, server_hostname=self._endpoint.host) if self._tls else plain
        except OSError as error:
            plain.close()
            if isinstance(error, ENDED):
                raise ConnectionError(opening_words(error, secure=self._endpoint.secure)) from error
            raise

    def send(self, report: Report) -> Delivery:
        """Send the events; bytes from the server are read and discarded."""
        if self._socket is None:
            raise ConnectionError("not connected")
        self._drain(self._socket)
        self._socket.settimeout(SOCKET_TIMEOUT_S)
        lines = b"".join(made + b"\n" for made in events(report))
        self._socket.sendall(lines)
        return Delivery.SENT if lines else Delivery.LEFT_OUT

    def _drain(self, sock: socket.socket) -> None:
        sock.settimeout(0.0)
        for _ in range(64):
            try:
                if not sock.recv(65_536):
                    raise ConnectionResetError("the server closed the connection")
            except (BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError):
                return

    def close(self, *, ended: bool) -> None:
        """Close the connection."""
        sock, self._socket = self._socket, None
        if sock is None:
            return
        try:
            if ended and isinstance(sock, ssl.SSLSocket):
                sock.settimeout(0.5)
                sock.unwrap()
        except (OSError, ValueError):
            pass
        finally:
            sock.close()


def _address(endpoint: Endpoint, kind: int) -> tuple[int, int, int, str, tuple[str, int]]:
    return socket.getaddrinfo(endpoint.host, endpoint.port, type=kind)[0]  # type: ignore[return-value]
