# SPDX-License-Identifier: MIT
"""The published schema says what the reader does; the page of fields says what the schema does."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from jsonschema import Draft202012Validator

from board_runs import ROOT
from echostep.plan import Plan, parse_plan
from echostep_app.plan.writer import plan_json
from plan.test_plan_model import FULL, GOOD, PLANS, WRONG

SCHEMA = json.loads((ROOT / "host/core/echostep/plans/plan.schema.json").read_text())
VALID = Draft202012Validator(SCHEMA)
BEYOND = {"without length", r"levels\[0\].doors\[0\].line", r"obstacles\[0\]"}  # what a schema cannot say
NAMES = {"connectors", "start"}  # refer to levels, which a schema cannot follow


def test_the_schema_is_one() -> None:
    Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("path", sorted((ROOT / "host/core/echostep/plans").glob("*.json")), ids=lambda path: path.name)
def test_plans_of_the_package(path: Path) -> None:
    if path.name != "plan.schema.json":
        VALID.validate(json.loads(path.read_text()))
        parse_plan(path.read_bytes())


def test_good_plans() -> None:
    VALID.validate(GOOD)
    VALID.validate(FULL)


@pytest.mark.slow
@given(PLANS)
@settings(max_examples=50, deadline=None)
def test_what_is_saved_is_valid(plan: Plan) -> None:
    VALID.validate(json.loads(plan_json(plan)))


@pytest.mark.parametrize(
    ("change", "named"),
    [case for case in WRONG if case[1] not in BEYOND and case[0].get("name") != "\ud800" and not set(case[0]) & NAMES],
)
def test_what_the_reader_refuses_is_invalid(change: dict[str, Any], named: str) -> None:
    assert not VALID.is_valid(GOOD | change), named
