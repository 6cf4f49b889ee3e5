# SPDX-License-Identifier: MIT
"""Settings: the dataclasses of all stages, read from a TOML file.

In: a TOML file (sections named as the fields of `Settings`). Out: `Settings`. Owns nothing; an error names the file, the section and the field.
"""

from __future__ import annotations

import dataclasses
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from sys import float_info
from typing import Any

from echostep.beacons.model import BeaconSettings
from echostep.board.calibration import GyroSettings, Imus, ImuSettings, RangerSettings
from echostep.echoes.likelihood import EchoSettings
from echostep.errors import EchostepError, has_left
from echostep.fields import checked, short
from echostep.foot.steps import FootSettings
from echostep.foot.trunk_path import GaitSettings
from echostep.height.levels import ClimbSettings
from echostep.legs.heading import CompassErrors
from echostep.legs.trunk_path import WearerSettings
from echostep.localization import CloudSettings
from echostep.timing.timeline import MtxTiming


@dataclass(frozen=True, slots=True)
class Settings:
    """Everything that can be set, by stage; the values: [settings.md](settings.md).

    >>> import echostep
    >>> from dataclasses import replace
    >>> settings = echostep.Settings()
    >>> settings.cloud.size
    660
    >>> fewer = replace(settings, cloud=replace(settings.cloud, size=300))
    >>> fewer
    Settings(cloud=CloudSettings(size=300))
    >>> echostep.replay("walk.mcap", "demo.json", settings=fewer)
    <Walk 'walk.mcap': 5 estimates, 2.0 s, 100% tracking, on 'Demo office'>
    """

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

    @classmethod
    def of_imu(cls, rate_hz: float) -> Settings:
        """Of a foot IMU at this rate, with nothing else on the wearer: for `Tracker.feed_samples`."""
        return parse_settings(imu_settings(rate_hz), "foot IMU")

    def __repr__(self) -> str:
        """The values that are not the default."""
        sections = ((f.name, getattr(self, f.name)) for f in dataclasses.fields(self))
        given = [f"{name}={_changed(section)}" for name, section in sections if section != type(section)()]
        return f"Settings({', '.join(given)})"

    @property
    def iron(self) -> CompassErrors | None:
        """Errors of the compass; None when it was not calibrated."""
        return None if self.compass == CompassErrors() else self.compass

    @property
    def imus(self) -> Imus:
        """Errors of the six-axis parts whose forces are used."""
        return Imus(self.foot_imu, self.belt_imu)


def _changed(section: Any) -> str:
    """A section as it is written in Python, with the values that are not the default."""
    default = type(section)()
    values = {f.name: getattr(section, f.name) for f in dataclasses.fields(section)}
    given = [f"{name}={value!r}" for name, value in values.items() if value != getattr(default, name)]
    return f"{type(section).__name__}({', '.join(given)})"


def imu_settings(rate_hz: float) -> str:
    """TOML text of the settings of a foot IMU at this rate, with nothing else on the wearer."""
    return f"[mtx]\nrate_hz = {rate_hz!r}\nlatency_s = 0.0\n\n[gait]\nfoot_left_m = 0.0\n"


RENAMED = {("echo", "short"): "hidden"}  # fields of older recordings, by their present names


def read_settings(path: Path | str) -> str:
    """TOML text of a settings file; raises EchostepError that names the file."""
    try:
        if text := Path(path).read_text(encoding="utf-8"):
            return text
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", "not UTF-8")
        raise EchostepError(f"{path}: cannot read the settings: {why}") from error
    raise EchostepError(f"{path}: an empty file, as a power failure leaves one: calibrate again, or give no settings")


def parse_settings(text: str, origin: str, *, recorded: bool = False) -> Settings:
    """Settings from TOML text; raises EchostepError that names the origin, the section and the field.

    `recorded`: the text is a recording's, which may carry settings that have left.
    """
    try:
        tree = tomllib.loads(text)
        defaults = {f.name: getattr(Settings(), f.name) for f in dataclasses.fields(Settings)}
        if unknown := tree.keys() - defaults.keys():
            raise ValueError(f"[{min(unknown)}] is no section; there are {', '.join(defaults)}")
        return Settings(
            **{name: _section(name, rows, defaults[name], recorded=recorded) for name, rows in tree.items()}
        )
    except ValueError as error:
        raise EchostepError(f"{origin}: {error}") from error
    except RecursionError as error:
        raise EchostepError(f"{origin}: its values are nested too deeply: settings are sections of numbers") from error


def _section(name: str, rows: Any, default: Any, *, recorded: bool) -> Any:
    """A copy of the section's defaults with the fields of `rows`; raises ValueError that names the field."""
    if not isinstance(rows, dict):
        raise ValueError(f"{name}: expected a section, [{name}]")
    known = dataclasses.asdict(default)
    former = {key: words for key in rows if (words := has_left(f"[{name}] {key}"))}
    if former and not recorded:
        raise ValueError(next(iter(former.values())))
    rows = {RENAMED.get((name, key), key): value for key, value in rows.items() if key not in former}
    for key, value in rows.items():
        if key not in known:
            raise ValueError(f"[{name}] {key}: unknown; there are {', '.join(known)}")
        if isinstance(value, float | int) and (not abs(value) <= float_info.max or value < 0 < known[key]):
            raise ValueError(f"[{name}] {key}: {short(value)} makes no sense; the default is {known[key]!r}")
    try:
        return checked(rows, type(default))
    except ValueError as error:
        raise ValueError(f"[{name}] {error}") from error
