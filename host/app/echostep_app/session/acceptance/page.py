# SPDX-License-Identifier: MIT
"""The page of an acceptance walk: one HTML file which needs nothing else.

In: a recording. Out: HTML, the same bytes each time. Owns the order of its parts. Whatever comes from the recording is escaped.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from statistics import median

from echostep.recording import clock_of
from echostep.walk.recorded import is_simulated
from echostep_app.output.score_page import document, picture
from echostep_app.output.score_plots import draw_on_plan
from echostep_app.printing.lines import as_error
from echostep_app.printing.progress import progress_line
from echostep_app.scorecard.card import Scored
from echostep_app.scorecard.definitions import METRICS, as_text
from echostep_app.session.acceptance.facts import clock_rows, loss_rows, version_rows
from echostep_app.session.acceptance.heard import AGREES_M, REACH_M, heard_shares
from echostep_app.session.acceptance.walked import Walked, by_point, score_taps, walk_again

SIMULATED = "Simulated: no board was worn. The figures show that the protocol works, not how well the tracker does."
MEASURED = "Measured: recorded from a board's ports."
# Of the metrics, those that surveyed points can tell and a page has room for
SHOWN = (
    "horizontal error, mean", "horizontal error, rms", "bias", "CE50 (CEP)", "CE95", "horizontal error, max", "VE95", "SE95",
    "floor detection", "availability", "95 % ellipse holds", "95 % radius holds", "protection radius holds",
)  # fmt: skip


def write_page(recording: Path) -> list[str]:
    """Track a recording again and write its page beside it; returns the most important figures, and where the page is. Raises EchostepError."""
    walked = walk_again(recording)
    scored = score_taps(walked, walked.timed)
    with progress_line("drawing the page"):
        text, out = page(walked, scored), recording.with_suffix(".html")
    with as_error(f"{out}: cannot write the page", "; copy the recording into a folder of yours"):
        out.write_text(text, encoding="utf-8")
    card = scored.card
    simulated = " (simulated)" if is_simulated(walked.recording.metadata) else ""
    figures = f"mean {card.horizontal.mean_m:.2f} m, CE50 {card.ce50_m:.2f} m, CE95 {card.ce95_m:.2f} m"
    return [f"{card.points} taps with a position: {figures}{simulated}", f"page: {out}"]


def page(walked: Walked, scored: Scored) -> str:
    """The page as HTML."""
    simulated = is_simulated(walked.recording.metadata)
    title = f"Acceptance walk: {walked.plan.name}" + (" (simulated)" if simulated else "")
    words = "Errors at the tapped points; a line joins the estimate to the point."
    parts = [
        f"<p><strong>{SIMULATED if simulated else MEASURED}</strong> {escape(_when(walked))}</p>",
        "<h2>Errors at the points</h2>", _metrics(walked, scored),
        picture(draw_on_plan(scored, walked.plan), words, ""),
        _table(
            ("point", "taps", "mean error (m)", "mean in x (m)", "mean in y (m)"),
            ((p.name, p.taps, f"{p.mean_m:.2f}", f"{p.x_m:+.2f}", f"{p.y_m:+.2f}") for p in by_point(walked, scored)),
        ),
        "<p class=\"note\">A tap in passing is itself late or early: a tenth of a second is a tenth of a metre at a walk.</p>",
        "<h2>Echoes by angle</h2>", *_heard(walked),
        "<h2>Clocks</h2>", _table((), clock_rows(walked)),
        "<h2>Losses and damage</h2>", _table((), loss_rows(walked)),
        "<h2>Versions and digests</h2>", _table((), version_rows(walked)),
        '<p class="note">echostep acceptance --recording FILE makes this page again from the recording alone.</p>',
    ]  # fmt: skip
    return document(title, parts)


def _when(walked: Walked) -> str:
    """The day of the walk, where the recording knows it; how long it took, and how many taps have no position."""
    day = walked.recording.metadata.get("started_utc", "")[:10] if clock_of(walked.recording.metadata) else ""
    return f"{f'{day}, ' if day else ''}{walked.arrivals.worn_s:.0f} s, {len(walked.taps.kept)} taps at {len(walked.protocol.points)} points."


def _metrics(walked: Walked, scored: Scored) -> str:
    """The metrics that have a value, for all taps, those standing and those passing."""
    columns = {"all": scored}
    for name, standing in (("standing", True), ("passing", False)):
        taps = [tap for tap in walked.timed if tap.standing is standing]
        if taps and len(taps) < len(walked.timed):
            columns[name] = score_taps(walked, taps)
    rows: list[tuple[object, ...]] = [("points", *(c.card.points for c in columns.values()), "taps with a position")]
    radii = (
        f"{median([walked.estimates[k].ellipse95.major_m for k in c.matched.row]):.2f} m" for c in columns.values()
    )
    rows.append(("95 % radius as stated, median", *radii, "what the tracker says of its own error"))
    for metric in METRICS:
        if metric.name in SHOWN and metric.value(scored.card) is not None:
            texts = (as_text(metric.value(c.card), metric.unit) for c in columns.values())
            rows.append((metric.name, *texts, f"{metric.meaning}{f' [{metric.source}]' if metric.source else ''}"))
    return _table(("metric", *columns, "what it is"), rows)


def _heard(walked: Walked) -> list[str]:
    shares = heard_shares(walked.pings.pings, walked.plan)
    if not shares:
        return ["<p>No ping was sent near a wall while the status was tracking.</p>"]
    heads = ("ranger", "angle to the wall's normal", "pings", "that wall", "nearer", "farther", "no echo")
    rows = (
        (s.ranger, f"{s.from_deg} to {s.to_deg} degrees", s.pings, *(f"{100.0 * share:.0f} %" for share in (s.wall, s.nearer, s.farther, s.none)))
        for s in shares
    )  # fmt: skip
    words = (
        f"Of pings whose axis meets a wall of the plan within {REACH_M:g} m: the echo is that wall's where its range is between the wall's "
        f"least distance and that along the axis, each by {AGREES_M:g} m. Poses are the tracker's."
    )
    return [_table(heads, rows), f'<p class="note">{words}</p>']


def _table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; the first cell of a row is its heading."""
    head = "".join(f'<th scope="col">{escape(name)}</th>' for name in heads)
    body = "".join(
        f'<tr><th scope="row">{escape(str(name))}</th>'
        + "".join(f"<td>{escape(str(cell))}</td>" for cell in cells)
        + "</tr>"
        for name, *cells in rows
    )
    return f'<div class="wide"><table>{f"<thead><tr>{head}</tr></thead>" if heads else ""}<tbody>{body}</tbody></table></div>'
