# SPDX-License-Identifier: MIT
"""TLS to brokers and TAK servers.

In: an endpoint with its files, PEM or PKCS #12 (.p12, .pfx, as TAK servers hand them out). Out: a context that always verifies the server's
certificate and name; EchostepError that names the file and the remedy. Owns nothing. PKCS #12 needs the package cryptography (extra `pkcs12`), which
reads the old ciphers too (RC2, 3DES) that OpenSSL 3 reads with `-legacy` alone.
"""

from __future__ import annotations

import secrets
import ssl
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from echostep.errors import EchostepError
from echostep_app.extras import lacks
from echostep_app.team.endpoint import Endpoint

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.serialization.pkcs12 import PKCS12KeyAndCertificates

PEM = b"-----BEGIN"  # how a file of text begins somewhere
DER_SEQUENCE = b"\x30"  # how PKCS #12 begins, and DER
# Passwords of a PKCS #12 whose own is not given; the last: of every file that a TAK server makes [TAK, makeCert.sh]
USUAL = (None, b"", b"atakatak")
LARGEST_FILE = 1 << 20  # bytes, of certificates
WORDS = {
    "KEY_VALUES_MISMATCH": "the key is not that of the certificate: give the two that were made together",
    "NO_START_LINE": "a file lacks its certificate or its key: look for -----BEGIN CERTIFICATE and -----BEGIN PRIVATE KEY",
    "PEM_LIB": "a file lacks its certificate or its key (look for -----BEGIN CERTIFICATE and -----BEGIN PRIVATE KEY), is damaged, or has "
    "another password",
}


class _NamedContext(ssl.SSLContext):
    """A context that asks for the certificate of `name`, where one is given, instead of the host's."""

    name = ""

    def wrap_socket(self, *arguments: Any, **more: Any) -> ssl.SSLSocket:
        return super().wrap_socket(*arguments, **more | ({"server_hostname": self.name} if self.name else {}))


def tls_context(endpoint: Endpoint) -> ssl.SSLContext:
    """A context for an endpoint; raises EchostepError."""
    content = {name: _content(endpoint, name) for name in endpoint.files}
    password = content["password"].strip(b"\r\n") if "password" in content else None
    context = _NamedContext(ssl.PROTOCOL_TLS_CLIENT)
    context.name = endpoint.certificate_name
    try:
        if "ca" in content:
            _trust(context, endpoint, content["ca"], password)
        else:
            context.load_default_certs()
        if "cert" in content:
            _identify(context, endpoint, content["cert"], password)
    except (OSError, ValueError) as error:
        names = ", ".join(f"{k}={v}" for k, v in endpoint.files.items())
        raise EchostepError(f"{endpoint}: cannot use {names}: {_file_words(error)}") from error
    return context


def _trust(context: ssl.SSLContext, endpoint: Endpoint, content: bytes, password: bytes | None) -> None:
    """Load the authorities: all certificates of the file."""
    if PEM in content:
        context.load_verify_locations(endpoint.files["ca"])
        return
    held = _pkcs12(endpoint, "ca", content, password)
    from cryptography.hazmat.primitives.serialization import Encoding

    certificates = [each for each in (held.cert, *held.additional_certs) if each is not None]
    if not certificates:
        raise _unusable(endpoint, "ca", "holds no certificate")
    pem = "".join(each.certificate.public_bytes(Encoding.PEM).decode() for each in certificates)
    context.load_verify_locations(cadata=pem)


def _identify(context: ssl.SSLContext, endpoint: Endpoint, content: bytes, password: bytes | None) -> None:
    """Load the client's certificate and key; those of PKCS #12 by a file, in which the key is encrypted, that exists for that moment only."""
    if PEM in content:
        context.load_cert_chain(
            endpoint.files["cert"], endpoint.files.get("key"), password=_no_password if password is None else password
        )
        return
    held = _pkcs12(endpoint, "cert", content, password)
    from cryptography.hazmat.primitives import serialization as form

    if held.key is None or held.cert is None:
        why = "holds no certificate with its key: it is not a client's file; is it for ca=?"
        raise _unusable(endpoint, "cert", why)
    cover = secrets.token_bytes(16).hex().encode()
    key = held.key.private_bytes(form.Encoding.PEM, form.PrivateFormat.PKCS8, form.BestAvailableEncryption(cover))
    chain = [each.certificate.public_bytes(form.Encoding.PEM) for each in (held.cert, *held.additional_certs)]
    with TemporaryDirectory() as folder:
        copy = Path(folder) / "client.pem"
        copy.write_bytes(b"".join([*chain, key]))
        context.load_cert_chain(copy, password=cover)


def _pkcs12(endpoint: Endpoint, name: str, content: bytes, password: bytes | None) -> PKCS12KeyAndCertificates:
    """Contents of a PKCS #12 file; raises EchostepError when it cannot be opened."""
    if lacking := lacks("PKCS #12", "cryptography"):
        file = Path(endpoint.files[name]).name
        pem = f"{file.rpartition('.')[0] or file}.pem"
        remedy = f"{lacking}; or once: openssl pkcs12 -legacy -nodes -in {file} -out {pem}, then {pem}"
        raise _unusable(endpoint, name, remedy)
    from cryptography.hazmat.primitives.serialization.pkcs12 import load_pkcs12

    said = ""
    for tried in (password, *USUAL):
        try:
            return load_pkcs12(content, tried)
        except ValueError as error:
            said = str(error)
    if "password" not in said.lower():
        der = "is damaged, or is DER: openssl x509 -inform der -in FILE -out FILE.pem makes PEM of a certificate"
        raise _unusable(endpoint, name, der)
    remedy = "that of password=FILE does not open it" if password is not None else "write it into a file, password=FILE"
    raise _unusable(endpoint, name, f"is PKCS #12 with a password: {remedy}")


def _unusable(endpoint: Endpoint, name: str, why: str) -> EchostepError:
    """The error of a file that cannot be used."""
    return EchostepError(f"{endpoint}: {name}={endpoint.files[name]}: {why}")


def _content(endpoint: Endpoint, name: str) -> bytes:
    """A file's bytes; raises EchostepError where it cannot be what its name says."""
    path = Path(endpoint.files[name])
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE)
    except FileNotFoundError:
        raise _unusable(endpoint, name, "there is no such file") from None
    except OSError as error:
        raise _unusable(endpoint, name, f"cannot be read: {error.strerror}") from error
    if name != "password" and PEM not in content and not content.startswith(DER_SEQUENCE):
        raise _unusable(endpoint, name, "holds no certificate and no key: a PEM file has lines with -----BEGIN")
    return content


def _file_words(error: Exception) -> str:
    """Why files do not make a context."""
    if isinstance(error, ssl.SSLError):
        reason = error.reason or str(error).partition(" (_ssl")[0].rpartition("] ")[2]
        return WORDS.get(reason.replace(" ", "_").upper(), reason)
    return str(error)


def _no_password() -> str:
    """Called by OpenSSL for an encrypted key: an error instead of a prompt on the terminal."""
    raise ValueError("the key is encrypted: write its password into a file, password=FILE")
