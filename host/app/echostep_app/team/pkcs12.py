# SPDX-License-Identifier: MIT
"""Files of PKCS #12 (.p12, .pfx), as TAK servers hand them out, as the PEM that Python's ssl reads.

In: a file's bytes and its password. Out: PEM; EchostepError with what to do. Owns nothing. Needs the package cryptography (extra `pkcs12`), which
reads the old ciphers too (RC2, 3DES) that OpenSSL 3 reads with `-legacy` alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from echostep.errors import EchostepError
from echostep.extras import lacks

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.serialization.pkcs12 import PKCS12KeyAndCertificates

DER_SEQUENCE = b"\x30"  # how PKCS #12 begins, and DER
# Passwords of a file whose own is not given; the last: of every file that a TAK server makes [TAK, makeCert.sh]
USUAL = (None, b"", b"atakatak")


def identity(content: bytes, password: bytes | None, file_name: str, cover: bytes) -> bytes:
    """The client's certificate, those of its authorities, and its key, encrypted with the password `cover`."""
    from cryptography.hazmat.primitives import serialization as form

    held = _opened(content, password, file_name)
    if held.key is None or held.cert is None:
        raise EchostepError("holds no certificate with its key: it is not a client's file; is it for ca=?")
    key = held.key.private_bytes(form.Encoding.PEM, form.PrivateFormat.PKCS8, form.BestAvailableEncryption(cover))
    chain = [held.cert, *held.additional_certs]
    return b"".join([*(each.certificate.public_bytes(form.Encoding.PEM) for each in chain), key])


def authorities(content: bytes, password: bytes | None, file_name: str) -> str:
    """All certificates of the file."""
    from cryptography.hazmat.primitives.serialization import Encoding

    held = _opened(content, password, file_name)
    certificates = [each for each in (held.cert, *held.additional_certs) if each is not None]
    if not certificates:
        raise EchostepError("holds no certificate")
    return "".join(each.certificate.public_bytes(Encoding.PEM).decode() for each in certificates)


def _opened(content: bytes, password: bytes | None, file_name: str) -> PKCS12KeyAndCertificates:
    if lacking := lacks("PKCS #12", "cryptography"):
        pem = f"{file_name.rpartition('.')[0] or file_name}.pem"
        raise EchostepError(f"{lacking}; or once: openssl pkcs12 -legacy -nodes -in {file_name} -out {pem}, then {pem}")
    from cryptography.hazmat.primitives.serialization.pkcs12 import load_pkcs12

    said = ""
    for tried in (password, *USUAL):
        try:
            return load_pkcs12(content, tried)
        except ValueError as error:
            said = str(error)
    if "password" not in said.lower():
        raise EchostepError(
            "is damaged, or is DER: openssl x509 -inform der -in FILE -out FILE.pem makes PEM of a certificate"
        )
    remedy = "that of password=FILE does not open it" if password is not None else "write it into a file, password=FILE"
    raise EchostepError(f"is PKCS #12 with a password: {remedy}")
