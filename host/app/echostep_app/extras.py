# SPDX-License-Identifier: MIT
"""Packages that not every installation has, and the extra of `pip install 'echostep[EXTRA]'` that brings each.

In: names of packages as they are imported. Out: whether they are installed, in words for who needs one. Owns the table. They are imported inside the
functions that use them, so that an installation without them lacks those functions alone.
"""

from __future__ import annotations

from importlib.util import find_spec

from echostep.errors import EchostepError

PAGE = ("starlette", "uvicorn", "websockets")
EXTRAS = dict.fromkeys((*PAGE, "segno"), "page") | {
    "cryptography": "pkcs12",
    "paho": "team",
    "pyproj": "plans",
    "ezdxf": "plans",
    "scipy": "plans",
    "matplotlib": "plots",
    "PIL": "plots",
    "pyarrow": "parquet",
    "pandas": "pandas",
    "ifcopenshell": "ifc",
    "rosbags": "ros",
    "foxglove": "foxglove",
}


def lacks(what: str, *packages: str) -> str:
    """The missing package, and the command that installs it; empty when nothing is."""
    for package in packages:
        if find_spec(package) is None:
            return f"{what} needs {package}, which is not installed: pip install 'echostep[{EXTRAS[package]}]'"
    return ""


def require(what: str, *packages: str) -> None:
    """Raises EchostepError when a package is not installed that `what` needs."""
    if words := lacks(what, *packages):
        raise EchostepError(words)
