# SPDX-License-Identifier: MIT
"""TLS: certificates as PEM and PKCS #12, encrypted keys; each fault of TLS and of the network is one sentence with the next step."""

from __future__ import annotations

import errno
import socket
from pathlib import Path

import pytest
import trustme
from cryptography import x509
from cryptography.hazmat.primitives import serialization as form
from cryptography.hazmat.primitives.serialization import pkcs12

from echostep.errors import EchostepError
from echostep_app.team.cot import StreamTransport
from echostep_app.team.endpoint import parse_endpoint
from echostep_app.team.faults import in_words
from echostep_app.team.tls import tls_context
from free_ports import free_port
from team.network import tak
from team.team_broker import Certificates

TAK = b"atakatak"  # the password that TAK servers use


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An authority, the server's certificate for takserver, and a client's in every form."""
    folder, authority = tmp_path_factory.mktemp("pkcs12"), trustme.CA()
    issued = authority.issue_cert("anna@example.org")
    authority.cert_pem.write_to_path(str(folder / "ca.pem"))
    authority.issue_cert("takserver").private_key_and_cert_chain_pem.write_to_path(str(folder / "server.pem"))
    issued.private_key_and_cert_chain_pem.write_to_path(str(folder / "client.pem"))
    root = x509.load_pem_x509_certificate(authority.cert_pem.bytes())
    client = x509.load_pem_x509_certificate(issued.cert_chain_pems[0].bytes())
    key = form.load_pem_private_key(issued.private_key_pem.bytes(), None)
    for name, password in (("tak", TAK), ("own", b"secret"), ("open", None)):
        cipher = form.BestAvailableEncryption(password) if password else form.NoEncryption()
        made = pkcs12.serialize_key_and_certificates(b"anna", key, client, [root], cipher)  # type: ignore[arg-type]
        (folder / f"{name}.p12").write_bytes(made)
    trust = pkcs12.serialize_key_and_certificates(None, None, None, [root], form.BestAvailableEncryption(TAK))
    (folder / "trust.p12").write_bytes(trust)
    locked = key.private_bytes(form.Encoding.PEM, form.PrivateFormat.PKCS8, form.BestAvailableEncryption(b"secret"))
    (folder / "locked.pem").write_bytes(locked + issued.cert_chain_pems[0].bytes())
    (folder / "secret").write_bytes(b"secret\n")
    (folder / "wrong").write_text("another")
    (folder / "damaged.p12").write_bytes(b"\x30\x82\x0a\x00\x02\x01\x03")
    (folder / "empty.pem").touch()
    (folder / "half.pem").write_text("-----BEGIN CERTIFICATE-----\nno\n-----END CERTIFICATE-----\n")
    return folder


@pytest.mark.parametrize(
    "query",
    [
        "ca={0}/trust.p12&cert={0}/tak.p12",
        "ca={0}/trust.p12&cert={0}/tak.p12&key={0}/tak.p12",
        "ca={0}/trust.p12&cert={0}/own.p12&password={0}/secret",
        "ca={0}/ca.pem&cert={0}/open.p12",
        "ca={0}/ca.pem&cert={0}/locked.pem&password={0}/secret",
        "ca={0}/ca.pem&cert={0}/client.pem",
    ],
)
def test_a_server_that_wants_a_certificate_accepts_it(folder: Path, query: str) -> None:
    context = tls_context(parse_endpoint(f"cot+tls://127.0.0.1?name=takserver&{query.format(folder)}"))
    with (
        tak(folder / "server.pem", folder / "ca.pem") as (port, received),
        socket.create_connection(("127.0.0.1", port)) as plain,
        context.wrap_socket(plain) as wrapped,
    ):
        assert wrapped.recv(100) == b"welcome"  # with TLS 1.3 a refused certificate would show here
        wrapped.sendall(b"an event")
    assert received == [b"an event"]


@pytest.mark.parametrize(
    ("query", "said"),
    [
        ("cert={0}/own.p12", r"cert=.*own\.p12: is PKCS #12 with a password: write it into a file, password=FILE"),
        ("cert={0}/own.p12&password={0}/ca.pem", "that of password=FILE does not open it"),
        ("cert={0}/trust.p12", "holds no certificate with its key: it is not a client's file; is it for ca="),
        ("cert={0}/locked.pem", "the key is encrypted: write its password into a file, password=FILE"),
        ("cert={0}/locked.pem&password={0}/wrong", "or has another password"),
        ("cert={0}/client.pem&password={0}/none", "password=.*none: there is no such file"),
        ("ca={0}/none.pem", "ca=.*none.pem: there is no such file"),
        ("ca={0}/half.pem", r"ca=.*half\.pem: "),
        ("cert={0}/ca.pem", "lacks its certificate or its key"),
        ("cert={0}/damaged.p12&key={0}/damaged.p12", r"damaged\.p12: is damaged, or is DER: openssl x509 -inform der"),
        ("cert={0}/empty.pem&key={0}/empty.pem", r"empty\.pem.*holds no certificate and no key"),
        ("cert={0}/half.pem&key={0}/half.pem", r"half\.pem.*cannot use|cannot use.*half\.pem"),
    ],
)
def test_what_cannot_be_opened_is_one_sentence(folder: Path, query: str, said: str) -> None:
    with pytest.raises(EchostepError, match=said) as caught:
        tls_context(parse_endpoint(f"cot+tls://host?{query.format(folder)}"))
    assert "\n" not in str(caught.value)
    assert "_ssl.c" not in str(caught.value)


def test_the_key_is_never_written_without_a_password(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written, write = list[bytes](), Path.write_bytes

    def kept(path: Path, content: bytes) -> int:
        written.append(content)
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", kept)
    tls_context(parse_endpoint(f"cot+tls://host?cert={folder}/tak.p12"))
    assert b"BEGIN ENCRYPTED PRIVATE KEY" in b"".join(written)
    assert b"BEGIN PRIVATE KEY" not in b"".join(written)


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
