# SPDX-License-Identifier: MIT
"""The pages of host/docs that are made from the code: one module a page.

In: the installed package. Out: the text of each page. Owns nothing: `docs.generate` writes and compares.
"""

from places import ROOT

HOST = ROOT / "host"
DOCS = HOST / "docs"
MADE = "Made by `make docs` from the code: do not edit.\n"
BEGIN, END = "<!-- made by make docs -->\n", "<!-- end -->\n"  # around the part of a page that is made


def between_marks(text: str, made: str) -> str:
    """A page with the part between its marks replaced."""
    before, _, rest = text.partition(BEGIN)
    return before + BEGIN + made + END + rest.partition(END)[2]
