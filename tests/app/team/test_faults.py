# SPDX-License-Identifier: MIT
"""Faults of TLS and of the network end in one sentence with the next step; each is provoked on real sockets and files."""

from __future__ import annotations

import errno
import socket
from pathlib import Path

import pytest

from echostep.errors import EchostepError
from echostep_app.team.cot import StreamTransport
from echostep_app.team.endpoint import parse_endpoint
from echostep_app.team.faults import in_words
from echostep_app.team.tls import tls_context
from free_ports import free_port
from team.network import tak
from team.team_broker import Certificates


def fault(url: str) -> str:
    """What is said of an attempt to connect; empty when it succeeds."""
    transport = StreamTransport(parse_endpoint(url))
    try:
        transport.open()
    except OSError as error:
        return in_words(error)
    finally:
        transport.close(ended=True)
    return ""


def test_a_certificate_of_another_name_is_named_and_its_name_can_be_given(certificates: Certificates) -> None:
    c = certificates
    with tak(c.elsewhere) as (port, _):
        said = fault(f"cot+tls://127.0.0.1:{port}?ca={c.ca}")
    assert said.startswith("the server's certificate is for another name: use that name as the host (in /etc/hosts")
    assert "name=NAME" in said
    with tak(c.elsewhere) as (port, _):
        assert fault(f"cot+tls://127.0.0.1:{port}?ca={c.ca}&name=broker.example") == ""
    with tak(c.elsewhere) as (port, _):
        assert "for another name" in fault(f"cot+tls://127.0.0.1:{port}?ca={c.ca}&name=other")


def test_an_unknown_authority_and_a_port_without_tls_are_named(certificates: Certificates) -> None:
    with tak(certificates.elsewhere) as (port, _):
        said = fault(f"cot+tls://127.0.0.1:{port}?name=broker.example")
    assert said.endswith("does not know: give the file of the authority that has signed it with ca=FILE")
    with tak(None) as (port, _):
        assert "does not speak TLS" in fault(f"cot+tls://127.0.0.1:{port}?ca={certificates.ca}")


def test_faults_of_the_network_say_where_to_look() -> None:
    assert "nothing listens at that address" in fault(f"cot+tcp://127.0.0.1:{free_port()}")
    assert "check its spelling" in in_words(socket.gaierror(socket.EAI_NONAME, "Name or service not known"))
    for number in (errno.ENETUNREACH, errno.EHOSTUNREACH):
        assert "is this computer in its network?" in in_words(OSError(number, "unreachable"))
    assert "does not answer" in in_words(TimeoutError("timed out"))
    assert in_words(BrokenPipeError("it broke")) == "it broke"


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("client.p12", b"\x30\x82\x0a\x00\x02\x01\x03", r"is damaged, or is DER: openssl x509 -inform der"),
        ("empty.pem", b"", "holds no certificate and no key"),
        ("half.pem", b"-----BEGIN CERTIFICATE-----\nno\n-----END CERTIFICATE-----\n", "cannot use"),
    ],
)
def test_a_file_that_is_no_certificate_is_named_with_the_remedy(
    tmp_path: Path, name: str, content: bytes, said: str
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(EchostepError, match=said) as caught:
        tls_context(parse_endpoint(f"cot+tls://h?cert={path}&key={path}"))
    assert name in str(caught.value)
    assert "_ssl.c" not in str(caught.value)
