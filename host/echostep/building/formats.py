"""Which format a file is in, and the plan in it.

In: a path. Out: `Plan`. Owns the list of formats.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

from echostep.building.wrld import import_wrld
from echostep.errors import EchostepError
from echostep.plan import Plan
from echostep.plan_writer import plan_json

STOREY_M = 3.5  # from floor to floor, where a format does not say


def import_plan(path: Path, storey_m: float = STOREY_M) -> Plan:
    """The plan in a file of another program; raises EchostepError that names the file and the place in it."""
    plan = _imported(path, storey_m)
    return replace(plan, digest=hashlib.sha256(plan_json(plan).encode()).hexdigest())


def _imported(path: Path, storey_m: float) -> Plan:
    main = path / "main.json" if path.is_dir() else path
    if main.name == "main.json":
        return import_wrld(main, storey_m)
    raise EchostepError(f"{path}: no format of plans that echostep knows")
