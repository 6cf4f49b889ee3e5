# SPDX-License-Identifier: MIT
"""The licence of every Python package that echostep needs, directly or through another one (`make licences`).

In: the metadata of the installed packages. Out: a Markdown table on standard output; exit status 1 when a package states no licence.
Owns nothing.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from importlib.metadata import Distribution, PackageNotFoundError, distribution

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

UNKNOWN = "not stated"
LONGEST = 80  # characters; a longer `License` field is the licence's text


def needed(name: str, extras: Iterable[str] = ()) -> dict[str, Distribution]:
    """Installed packages that a package with these extras needs, itself excluded, by name."""
    packages: dict[str, Distribution] = {}
    seen: set[tuple[str, str]] = set()
    waiting = [(name, extra) for extra in ("", *extras)]
    while waiting:
        package, extra = waiting.pop()
        if (package, extra) in seen:
            continue
        seen.add((package, extra))
        try:
            packages[package] = distribution(package)
        except PackageNotFoundError:
            continue  # an optional one of another system or of an extra that is not installed
        for requirement in map(Requirement, packages[package].requires or ()):
            if requirement.marker is None or requirement.marker.evaluate({"extra": extra}):
                waiting += [(canonicalize_name(requirement.name), other) for other in ("", *requirement.extras)]
    return {key: packages[key] for key in sorted(packages) if key != name}


def for_developers() -> dict[str, Distribution]:
    """Installed packages that echostep, its extras, its tests or its studies need, by name."""
    packages = needed("echostep-app", ("dev",)) | needed("echostep-studies", ("cluster",))
    return {key: packages[key] for key in sorted(packages) if not key.startswith("echostep")}


def licence(package: Distribution) -> str:
    """What the package's metadata states: an SPDX expression, else classifiers, else `License`, else its file."""
    lines = [line.rsplit(" :: ", 1)[1] for line in _fields(package, "Classifier") if line.startswith("License :: ")]
    short = [text for text in _fields(package, "License") if len(text) <= LONGEST and "\n" not in text]
    stated = [*_fields(package, "License-Expression")[:1], "; ".join(lines), *short, _first_line(package), UNKNOWN]
    return next(text for text in stated if text)


def _fields(package: Distribution, name: str) -> list[str]:
    """Every value of a field of the metadata."""
    return [text.strip() for text in package.metadata.get_all(name) or []]


def _first_line(package: Distribution) -> str:
    """First line of the package's licence file."""
    for name in _fields(package, "License-File"):
        text = package.read_text(f"licenses/{name}") or package.read_text(name) or ""
        if text.strip():
            return text.strip().splitlines()[0].strip()
    return ""


def main() -> int:
    """Print the table; the dependencies of `pip install echostep` first."""
    parser = argparse.ArgumentParser(description="licences of all dependencies, as a Markdown table")
    parser.parse_args()
    runtime, optional, everything = needed("echostep-app"), needed("echostep-app", ("all",)), for_developers()
    print("| package | version | licence | needed |\n|---|---|---|---|")
    for name, package in sorted(everything.items(), key=lambda item: (item[0] not in runtime, item[0])):
        use = "to run" if name in runtime else "by an extra" if name in optional else "to develop, or by the studies"
        print(f"| {name} | {package.version} | {licence(package)} | {use} |")
    unknown = [name for name, package in everything.items() if licence(package) == UNKNOWN]
    if unknown:
        print(f"no licence is stated by: {', '.join(unknown)}", file=sys.stderr)
    return int(bool(unknown))


if __name__ == "__main__":
    sys.exit(main())
