# SPDX-License-Identifier: MIT
"""`echostep evaluate gaits`: walking, hurrying, running, crawling, sidestepping, stairs and ladders, by the foot alone and by the legs alone.

In: seeds. Out: a row a manner and sensor, means over the runs; two tables. Owns nothing. Everything is simulated.
"""

from __future__ import annotations

from statistics import fmean

from echostep.output.table import Table
from echostep_studies.frame.report import Row, rows_by_name
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.gaits.foot import STEPS, foot_rows
from echostep_studies.gaits.legs import CYCLES, leg_rows

FOOT_COLUMNS = {
    "name": "", "way_m": "way m", "way_percent": "way %", "ending_m": "end m", "worst_m": "worst m", "height_m": "height m",
    "steps_percent": "steps %",
}  # fmt: skip
LEG_COLUMNS = {
    "name": "", "forward_m": "forward m", "found_m": "found m", "sd_m": "sd m", "error_over_sd": "error / sd", "up_m": "up m", "rise_m": "rise m",
    "stairs_percent": "stairs %", "blind_percent": "unseen %",
}  # fmt: skip


def one_run(seed: int) -> list[Row]:
    """All manners, once."""
    return foot_rows(seed) + leg_rows(seed)


def summarize(rows: list[Row]) -> list[Row]:
    """Means of each manner over the runs; `worst_m`: the greatest error of an end."""
    found: list[Row] = []
    for group in rows_by_name(rows):
        means = {key: fmean(row[key] for row in group) for key in group[0] if key not in ("name", "seed")}
        worst = {"worst_m": max(row["ending_m"] for row in group)} if "ending_m" in means else {}
        found.append({"name": group[0]["name"], "runs": len(group)} | means | worst)
    return found


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    runs = f"{request.runs} runs, simulated"
    return [
        Table(f"The foot alone, {STEPS} steps, {runs}", [r for r in rows if "ending_m" in r], FOOT_COLUMNS),
        Table(f"One leg alone, {CYCLES} cycles, {runs}", [r for r in rows if "found_m" in r], LEG_COLUMNS),
    ]


STUDY = Study("gaits", one_run, summarize, _tables)
