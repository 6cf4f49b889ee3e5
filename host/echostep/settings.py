# SPDX-License-Identifier: MIT
"""Settings: the dataclasses of all stages, read from a TOML file.

In: a TOML file (sections named as the fields of `Settings`). Out: `Settings`. Owns nothing; an error names the file, the section and the field.
"""

from __future__ import annotations

import dataclasses
import math
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from echostep.board.calibration import GyroSettings, Imus, ImuSettings, RangerSettings
from echostep.errors import EchostepError
from echostep.foot.steps import FootSettings
from echostep.foot.trunk_path import GaitSettings
from echostep.legs.heading import CompassErrors
from echostep.legs.trunk_path import WearerSettings
from echostep.localization.beacons.model import BeaconSettings
from echostep.localization.echoes.likelihood import EchoSettings
from echostep.localization.height.levels import ClimbSettings
from echostep.localization.settings import CloudSettings
from echostep.timing.timeline import MtxTiming


@dataclass(frozen=True, slots=True)
class Settings:
    """Everything that can be set, by stage."""

    mtx: MtxTiming = field(default_factory=MtxTiming)
    ranger: RangerSettings = field(default_factory=RangerSettings)
    gyro: GyroSettings = field(default_factory=GyroSettings)
    foot_imu: ImuSettings = field(default_factory=ImuSettings)
    thigh_imu: ImuSettings = field(default_factory=ImuSettings)
    calf_imu: ImuSettings = field(default_factory=ImuSettings)
    belt_imu: ImuSettings = field(default_factory=ImuSettings)
    compass: CompassErrors = field(default_factory=CompassErrors)
    foot: FootSettings = field(default_factory=FootSettings)
    gait: GaitSettings = field(default_factory=GaitSettings)
    echo: EchoSettings = field(default_factory=EchoSettings)
    cloud: CloudSettings = field(default_factory=CloudSettings)
    beacons: BeaconSettings = field(default_factory=BeaconSettings)
    climb: ClimbSettings = field(default_factory=ClimbSettings)
    wearer: WearerSettings = field(default_factory=WearerSettings)

    @property
    def iron(self) -> CompassErrors | None:
        """Errors of the compass; None when it was not calibrated."""
        return None if self.compass == CompassErrors() else self.compass

    @property
    def imus(self) -> Imus:
        """Errors of the six-axis parts whose forces are used."""
        return Imus(self.foot_imu, self.belt_imu)


RENAMED = {("echo", "short"): "hidden"}  # fields of older recordings, by their present names


def read_settings(path: Path | str) -> str:
    """TOML text of a settings file; raises EchostepError that names the file."""
    try:
        return Path(path).read_text()
    except (OSError, UnicodeDecodeError) as error:
        raise EchostepError(f"{path}: cannot read the settings: {error}") from error


def parse_settings(text: str, origin: str) -> Settings:
    """Settings from TOML text; raises EchostepError that names the origin, the section and the field."""
    try:
        return _settings_of(tomllib.loads(text))
    except ValueError as error:
        raise EchostepError(f"{origin}: {error}") from error


def _settings_of(tree: dict[str, Any]) -> Settings:
    """Settings from a parsed TOML tree; raises ValueError that names the section and the field."""
    sections = {f.name: f.default_factory for f in dataclasses.fields(Settings)}
    sections_read: dict[str, Any] = {}
    for name, rows in tree.items():
        if name not in sections:
            raise ValueError(f"[{name}] is no section; there are {', '.join(sections)}")
        sections_read[name] = _section(name, rows, sections[name]())  # type: ignore[operator]
    return Settings(**sections_read)


def _section(name: str, rows: Any, default: Any) -> Any:
    """A copy of the section's defaults with the fields of `rows`; raises ValueError that names the field."""
    if not isinstance(rows, dict):
        raise ValueError(f"{name}: expected a section, [{name}]")
    known = {f.name: getattr(default, f.name) for f in dataclasses.fields(default)}
    rows = {RENAMED.get((name, key), key): value for key, value in rows.items()}
    for key, value in rows.items():
        if key not in known:
            raise ValueError(f"[{name}] {key}: unknown; there are {', '.join(known)}")
        if isinstance(value, bool) != isinstance(known[key], bool) or not isinstance(value, int | float | bool):
            raise ValueError(f"[{name}] {key}: {value!r} is not a number like the default {known[key]!r}")
        if isinstance(known[key], int) and not isinstance(value, int):
            raise ValueError(f"[{name}] {key}: {value!r} is not a whole number")
        if not math.isfinite(value) or (known[key] > 0 and value < 0):
            raise ValueError(f"[{name}] {key}: {value!r} makes no sense; the default is {known[key]!r}")
    return dataclasses.replace(default, **{k: type(known[k])(v) for k, v in rows.items()})
