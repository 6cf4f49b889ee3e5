# SPDX-License-Identifier: MIT
"""A page about scores: one HTML file with the table, the pictures and the definitions, which needs nothing else.

In: `Scored` tracks. Out: HTML. Owns nothing. Whatever comes from a file is escaped.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from echostep.plan import Plan
from echostep_app.output.score_plots import draw_distribution, draw_on_plan, draw_stanford
from echostep_app.printing.picture_files import svg_text
from echostep_app.scorecard.card import Scored
from echostep_app.scorecard.definitions import METRICS, as_text, notes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.45 system-ui, sans-serif; color: #1b1f24; background: #fff; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2.2rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .6rem; border-bottom: 1px solid #c3c9d1; text-align: left; vertical-align: top; }
td.figure { text-align: right; white-space: nowrap; } thead th { border-bottom: 2px solid #545b64; overflow-wrap: anywhere; }
td.about { color: #545b64; font-size: .85rem; } img { max-width: 100%; height: auto; } p.note { color: #545b64; }
figure { margin: 1rem 0; } figcaption { font-size: .9rem; color: #545b64; }
@media print { body { margin: 0; } figure { break-inside: avoid; } }
"""


@dataclass(frozen=True, slots=True)
class ScoreReport:
    """What a page shows: scores of tracks with their `names`, against the file `truth`, on `plan`."""

    scored: Sequence[Scored]
    names: Sequence[str]
    truth: str
    plan: Plan | None

    @property
    def title(self) -> str:
        """Heading of the table and the page."""
        return f"Scores against {self.truth}" + (f" on {self.plan.name}" if self.plan else "")


def short_names(paths: Sequence[Path]) -> list[str]:
    """The shortest unique endings of the paths."""
    for parts in range(1, max(len(path.parts) for path in paths) + 1):
        names = ["/".join(path.parts[-parts:]) for path in paths]
        if len(set(names)) == len(names):
            return names
    return [f"{k + 1}: {path.name}" for k, path in enumerate(paths)]


def page(report: ScoreReport) -> str:
    """The page as HTML."""
    parts = [
        *(f'<p class="note">{escape(line)}</p>' for one in report.scored for line in notes(one.card)),
        _table(report),
    ]
    parts += ["<h2>Distribution of the errors</h2>"]
    parts.append(picture(draw_distribution(report.scored, report.names), "Share of the points below each error.", ""))
    for one, name in zip(report.scored, report.names, strict=True):
        parts.append(f"<h2>{escape(name)}</h2>")
        words = (
            f"CE95 is {one.card.ce95_m:.2f} m; colours beyond it are alike. A line joins a position to the true place."
        )
        parts.append(picture(draw_on_plan(one, report.plan), words, f"Errors of {name} on the plan"))
        stanford = draw_stanford(one)
        if stanford is None:
            parts.append("<p>The track states no radius: there is no Stanford diagram.</p>")
        else:
            words = (
                f"Stanford diagram: the {one.radius_name} that the track states against its error; both end at 100 m."
            )
            parts.append(picture(stanford, words, f"Stanford diagram of {name}"))
    return document(report.title, parts)


def document(title: str, parts: Sequence[str]) -> str:
    """A whole page of HTML parts under a title, which is escaped here."""
    body = "\n".join([f"<h1>{escape(title)}</h1>", *parts])
    return (
        f'<!doctype html>\n<html lang="en">\n<head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><title>{escape(title)}</title>'
        f"<style>{STYLE}</style></head>\n<body><main>\n{body}\n</main></body>\n</html>\n"
    )


def _table(report: ScoreReport) -> str:
    heads = "".join(f'<th scope="col">{escape(name)}</th>' for name in report.names)
    rows = []
    for metric in METRICS:
        cells = "".join(
            f'<td class="figure">{as_text(metric.value(one.card), metric.unit)}</td>' for one in report.scored
        )
        about = f"{metric.meaning}<br>{metric.source}" if metric.source else metric.meaning
        rows.append(f'<tr><th scope="row">{metric.name}</th>{cells}<td class="about">{about}</td></tr>')
    return (
        f'<div class="wide" tabindex="0" role="region" aria-label="Scores"><table><thead><tr><th scope="col">metric</th>{heads}'
        f'<th scope="col">what it is</th></tr></thead><tbody>{"".join(rows)}</tbody></table></div>'
    )


def picture(figure: Figure, words: str, alt: str) -> str:
    """A figure with its caption, inside the page."""
    data = base64.b64encode(svg_text(figure).encode()).decode()
    return (
        f'<figure><img alt="{escape(alt or words)}" src="data:image/svg+xml;base64,{data}">'
        f"<figcaption>{escape(words)}</figcaption></figure>"
    )
