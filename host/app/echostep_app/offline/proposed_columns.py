# SPDX-License-Identifier: MIT
"""The options that would read a foot's file, from the titles of its columns.

In: titles. Out: `--columns` and `--units`, ready to paste; empty where a title may mean two things. Owns nothing.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence

from echostep.offline.imu_csv import COLUMNS

UNITS = {
    "s": "s sec seconds", "ms": "ms msec milliseconds", "us": "us µs μs microseconds", "ns": "ns nanoseconds",
    "m/s2": "m/s2 m/s^2 m/s² m/s/s mps2 m_s2 ms2", "g": "g", "mg": "mg", "rad/s": "rad/s rad/sec rad_s rads", "deg/s": "deg/s deg/sec °/s dps deg_s",
}  # fmt: skip
BY_SPELLING = {spelling: unit for unit, spellings in UNITS.items() for spelling in spellings.split()}
SI = ("s", "m/s2", "rad/s")
BEFORE = r"(?:imu|field|sensor|raw)*"  # words that change nothing
KINDS = {  # beginning of this project's name, and what it is called without signs between the words
    "t_s": r"t|time|times|timestamps?|timesec|seconds|secondselapsed",
    "a": r"a|acc|accel|accelero|acceleration|accelerometer",
    "g": r"g|gyr|gyro|gyroscope|w|omega|angvel|angularvelocity|angularrate|rotationrate",
}
ROS = r"linearacceleration"  # with gravity, in m/s2, beside angular_velocity [sensor_msgs/Imu]
FREE = re.compile(r"(?:lin|linear|free|user)acc\w*")


def proposal(titles: Sequence[str]) -> str:
    """The options for a file with these columns, or why none would do, as the end of an error; empty where the titles are not certain."""
    ros = any("angularvelocity" in _letters(title) for title in titles)
    found: dict[str, tuple[str, str]] = {}
    for title in titles:
        name, unit = _parted(title)
        if not (ours := _ours(name, ros)):
            continue
        if ours in found or "," in title or unit is None:
            return ""
        found[ours] = title, unit
    free = next((title for title in titles if FREE.match(_letters(title))), "")
    if free and "ax" not in found:
        return f"; {free} is without gravity, which a track needs: record the accelerometer itself"
    if not set(COLUMNS) <= found.keys():
        return ""
    units = {name: {found[name + axis][1] for axis in "xyz"} for name in "ag"} | {"t": {found["t_s"][1]}}
    if any(len(each) > 1 for each in units.values()):
        return ""
    given = [unit for each in units.values() for unit in each if unit and unit not in SI]
    columns = shlex.quote(",".join(f"{ours}={found[ours][0]}" for ours in COLUMNS))
    return f"; by their titles: --columns {columns}{' --units ' + ','.join(given) if given else ''}"


def _letters(text: str) -> str:
    """Small letters and digits alone."""
    return re.sub(r"[^a-z0-9]", "", text.casefold())


def _parted(title: str) -> tuple[str, str | None]:
    """Name and unit of a title, "" where it states none, None for a unit that is not known."""
    if bracket := re.search(r"[(\[]([^)\]]*)[)\]]\s*$", title):
        return title[: bracket.start()], BY_SPELLING.get(bracket[1].strip().casefold())
    for spelling, unit in sorted(BY_SPELLING.items(), key=lambda each: -len(each[0])):
        if re.search(rf"[xyz]?[_ .]{re.escape(spelling)}$", title, re.I) and title.casefold() != "t_s":
            return title[: -len(spelling)], unit
    return title, ""


def _ours(name: str, ros: bool) -> str:
    """A column by the name that this project has for it; empty for any other."""
    letters = _letters(name)
    if re.fullmatch(BEFORE + f"(?:{KINDS['t_s']})", letters):
        return "t_s"
    for ours in "ag":
        kind = KINDS[ours] + (f"|{ROS}" if ros and ours == "a" else "")
        found = re.fullmatch(f"{BEFORE}(?:(?:{kind})([xyz])|([xyz])(?:{kind}))", letters)
        if found:
            return ours + (found[1] or found[2])
    return ""
