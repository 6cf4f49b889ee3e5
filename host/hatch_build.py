# SPDX-License-Identifier: MIT
"""What hatchling asks: the metadata that depends on where the project is published, and what the app's wheel holds beside it.

In: the environment variable ECHOSTEP_URL, the public address of the repository (`make wheel URL=...`), and README.md beside this file. Out: `urls`
and `readme` of the metadata. Without an address there are no links, and README.md is taken as it is. Owns nothing.
"""

from __future__ import annotations

import os
import re
from pathlib import Path, PurePosixPath
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

FOLDER = "host"  # of this file in the repository
PICTURES = {".png", ".svg", ".webp"}
LINK = re.compile(r"(?<=\]\()(?!https?:|#)([^)#]+)")  # the target of a relative Markdown link


def absolute(text: str, url: str) -> str:
    """README.md with absolute links: pages below blob/main, pictures below raw/main, as GitHub and GitLab serve them."""

    def target(match: re.Match[str]) -> str:
        parts: list[str] = []
        for part in PurePosixPath(FOLDER, match[1]).parts:
            parts = parts[:-1] if part == ".." else [*parts, part]
        kind = "raw" if PurePosixPath(match[1]).suffix in PICTURES else "blob"
        return "/".join([url, kind, "main", *parts])

    return LINK.sub(target, text)


def links(url: str) -> dict[str, str]:
    """Label -> address, the labels that PyPI knows [well-known project URLs]."""
    pages = {"Documentation": "docs/README.md", "Changelog": "CHANGELOG.md", "Contributing": "CONTRIBUTING.md"}
    return {"Homepage": url, "Source": url, "Issues": f"{url}/issues"} | {
        label: f"{url}/blob/main/{FOLDER}/{page}" for label, page in pages.items()
    }


class PublishedMetadata(MetadataHookInterface):
    """Called by hatchling, which finds this class by its base."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Set `urls` and `readme`."""
        url = os.environ.get("ECHOSTEP_URL", "").rstrip("/")
        text = Path(self.root, "../README.md").read_text(encoding="utf-8")
        metadata["urls"] = links(url) if url else {}
        metadata["readme"] = {"content-type": "text/markdown", "text": absolute(text, url) if url else text}


class RingOfTheSimulation(BuildHookInterface):
    """The app's wheel holds the ring of the simulation, too; an editable install must not copy it, or the copy would hide the source."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the folder to a standard wheel."""
        if version == "standard":
            build_data["force_include"]["../simulation/echostep_simulation"] = "echostep_simulation"
