# SPDX-License-Identifier: MIT
"""The texts that the pages and the host have in their source: what the catalogue of a language must have entries for.

In: source files. Out: texts with 7 in each hole. Owns the lists of what is searched, and of what looks like words and is none.
"""

from __future__ import annotations

import ast
import itertools
import re
from collections.abc import Iterator
from pathlib import Path

from board_runs import ROOT

HOST = ROOT / "host/app/echostep_app"
FOLDERS = ("page/static", "page/static/wearer", "page/static/commander", "page/static/tools")
ELSEWHERE = ("export.js", "theme.js", "language.js")  # GeoJSON, queries of styles, names of languages
# Functions and classes whose texts a page shows; None: all of the module.
MODULES: dict[str, tuple[str, ...] | None] = {
    "guidance/cues.py": ("NO_HEADING", "NEVER_KNOWN", "Guide"),
    "guidance/guided_rescue.py": ("GuidedRescue",),
    "guidance/guided_return.py": ("IN", "GuidedReturn"),
    "operation/distress.py": None,
    "operation/operation.py": ("Operation",),
    "operation/session.py": None,
    "operation/words.py": None,
    "page/elements/alarm.py": None,
    "page/elements/guidance.py": None,
    "page/elements/likely_places.py": None,
    "page/elements/marks.py": None,
    "page/elements/scene.py": None,
    "page/elements/stream_rates.py": None,
    "page/elements/taps.py": None,
    "page/guarded_socket.py": ("UNKNOWN", "TOO_LATE"),
    "page/live.py": None,
    "page/over_time.py": None,
    "page/session.py": None,
    "page/web/exchange.py": ("Exchange",),
    "plan/places/standing.py": ("_reason", "StandingGround"),
    "plan/places/whereabouts.py": None,
    "session/results.py": ("summary_words",),
    "wearer/steady_status.py": None,
    "session/runs/dropped.py": ("DroppedFiles", "WAITING", "PREPARING", "_track"),
    "team/commander.py": ("notes",),
    "team/cot.py": ("alarm_words",),
    "team/messages/marks.py": ("Errand",),
    "team/publish.py": ("receipt",),
}
# What the plan editor shows, refusals included.
EDITOR: dict[str, tuple[str, ...] | None] = {
    "page/editor.py": ("_body", "_post_plan"),
    "plan/check.py": None,
    "plan/importers/dxf/doors.py": ("questions",),
    "plan/importers/dxf/drawing.py": ("_left_out_walls",),
    "plan/places/reachability.py": None,
    "plan/questions.py": None,
}
WORDS = re.compile(r"[a-z]{2}.* .*[a-z]|^[A-Z][a-z]+[a-z.!?]$")
NO_WORDS = re.compile(r"[<{/]|system-ui|^\(|^trans(form|late)\b|, select,|^#|^sign |^circle |^name ")
# Texts that are put together from variables: what a page gets of them.
WHOLE = {
    "Take the 7 7": tuple(
        f"Take the {way}{name} {to}" for way in ("stairs", "lift", "ramp") for name in ("", " 3", " A") for to in ("up", "down")
    ),
    "7: 7 places fit; walk on, turn into a room7": (
        "lost: 7 places fit; walk on, turn into a room or tap where you are",
        "uncertain: 7 places fit; walk on, turn into a room",
    ),
    " or tap where you are": (),
    "lost: 7 for 7 s": ("lost: nothing from the foot for 7 s", "lost: no step of the foot for 7 s"),
    "nothing from the foot": ("Stop. There is nothing from the foot.",),
    "no step of the foot": ("Stop. There is no step of the foot.",),
    "There is 7": (),
    " (without counter, acceleration or rate of turn)": (
        "the MTx sends no usable samples (without counter, acceleration or rate of turn)",
    ),
    "drop its plan": (),
    "is not enclosed by walls, doors and gaps": ("room 7 is not enclosed by walls, doors and gaps",),
    "no door": (),
    "open room": (),
    "7 as you pass": ("press as you pass",),
    "7 as you arrive, then turn slowly on the spot": ("press as you arrive, then turn slowly on the spot",),
    "Stand on point 7, look to point 7, and stay. 7 while you stand.": (
        "Stand on point 7, look to point 7, and stay. Press while you stand.",
    ),
    "ends in no wall": ("door 7 ends in no wall",),
    "ends 7 m from any wall": ("door 7 ends 7 m from any wall",),
    "right angle": (),
    "picture of 7": (),
}  # fmt: skip
CODE = re.compile(
    r"""(?:^|(?<=\s))//[^\n]*|'(?:[^'\\\n]|\\.)*'|"[^"\n]*"|(?<=\()/(?:[^/\\\n]|\\.)+/|(?s:.)""", re.MULTILINE
)  # comments, strings, patterns; else single characters
TEMPLATE = re.compile(r"\$\{|\\.|(?s:.)")


def page_texts() -> set[str]:
    """Texts in the scripts of both pages."""
    return _plain(_scripts(*FOLDERS))


def editor_texts() -> set[str]:
    """Texts in the scripts of the plan editor, and in what the host sends to it."""
    sent = (text for name, parts in EDITOR.items() for text in _constants(HOST / name, parts, refusals=True))
    return _plain(itertools.chain(_scripts("page/edit"), sent))


def host_texts() -> set[str]:
    """Texts in what the host sends to a page."""
    return _plain(text for name, parts in MODULES.items() for text in _constants(HOST / name, parts))


def _scripts(*folders: str) -> Iterator[str]:
    """The strings of the scripts in these folders."""
    files = [path for folder in folders for path in (HOST / folder).glob("*.js") if path.name not in ELSEWHERE]
    return (text for path in files for text in _literals(path.read_text("utf-8")))


def _plain(texts: Iterator[str]) -> set[str]:
    """Those that are texts: without what follows or precedes a word at once, and a name or a sentence before one."""
    found = [part for text in texts if _is_text(text) for part in WHOLE.get(text, (text,))]
    return {re.sub(r"(^|\. )7 (?=[A-Z])", r"\1", re.sub(r"(?<=[a-z])7|7(?=[a-z])", "", text)) for text in found}


def _is_text(text: str) -> bool:
    return bool(WORDS.search(text)) and not NO_WORDS.search(text)


def _literals(script: str) -> Iterator[str]:
    """The strings of a script, those within the holes of templates too."""
    stack: list[str | None] = [None]  # templates that are open, by what was read of them; None: code within braces
    at = 0
    while at < len(script):
        found = (CODE if stack[-1] is None else TEMPLATE).match(script, at)
        assert found
        token, at = found[0], found.end()
        if (text := stack[-1]) is not None:
            if token == "`":
                yield text
                stack.pop()
            elif token == "${":
                stack.append(None)
            else:
                stack[-1] = text + token
        elif token[0] in "'\"" and len(token) > 1:
            yield token[1:-1].replace("\\'", "'")
        elif token in "{`":
            stack.append(None if token == "{" else "")
        elif token == "}":
            stack.pop()
            if (text := stack[-1]) is not None:
                stack[-1] = f"{text}7"


def _constants(path: Path, parts: tuple[str, ...] | None, *, refusals: bool = False) -> Iterator[str]:
    """The strings of these parts of a module, without docstrings, and without errors where these are for the terminal."""
    tree = ast.parse(path.read_text("utf-8"))
    wanted = [node for node in ast.walk(tree) if parts is None or _name(node) in parts] if parts else [tree]
    assert wanted, path
    left_out = {id(inner) for node in ast.walk(tree) if _is_left_out(node, refusals) for inner in ast.walk(node)}
    for node in itertools.chain.from_iterable(map(ast.walk, wanted)):
        if id(node) in left_out:
            continue
        if isinstance(node, ast.JoinedStr):
            left_out |= {id(inner) for inner in ast.walk(node)}
            yield from map("".join, itertools.product(*map(_alternatives, node.values)))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value.replace("{}", "7")


def _name(node: ast.AST) -> str:
    if isinstance(node, ast.Assign):
        first = node.targets[0]
        return ",".join(n.id for n in ast.walk(first) if isinstance(n, ast.Name)).split(",")[0]
    return getattr(node, "name", "")


def _is_left_out(node: ast.AST, refusals: bool) -> bool:
    """Docstrings, what is raised unless `refusals`, annotations."""
    if isinstance(node, ast.Expr):
        return isinstance(node.value, ast.Constant)
    return isinstance(node, ast.Raise) and not refusals


def _alternatives(part: ast.expr) -> list[str]:
    """What a part of an f-string can be: each text that its hole chooses from, or 7."""
    if isinstance(part, ast.Constant):
        return [str(part.value)]
    chosen = part.value if isinstance(part, ast.FormattedValue) else part
    if isinstance(chosen, ast.IfExp):
        return _alternatives(chosen.body) + _alternatives(chosen.orelse)
    if isinstance(chosen, ast.BinOp) and isinstance(chosen.left, ast.Constant) and isinstance(chosen.left.value, str):
        return ["", chosen.left.value]
    return ["7"]
