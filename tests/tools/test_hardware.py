# SPDX-License-Identifier: MIT
"""The materials for building: wiring as in the firmware's sources, sound nets, parts for each role, a guide that shows what the twin prints."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from board_runs import ROOT, needs_twin
from command_line import echostep
from docs.pages import hardware
from echostep_simulation.stimulus import EXTENDED_ROW, NO_SYNC
from hardware.nets import HIGH_MIN_V, PULL_UP_OHM, idle_v, problems
from hardware.wiring import Device, WiredBoard, boards, pins
from players import twin_board

FIRMWARE = ROOT / "firmware"
README = (FIRMWARE / "README.md").read_text()
ON_MICRO = {  # Arduino's pin-out of the Micro, of 23 March 2020
    "PD1": "D2", "PD0": "D3", "PD4": "D4", "PC6": "D5", "PD7": "D6", "PE6": "D7", "PB4": "D8", "PB5": "D9", "PB6": "D10",
    "PB7": "D11", "PD6": "D12", "PC7": "D13", "PF7": "A0", "PF6": "A1", "PF5": "A2", "PF4": "A3", "PF1": "A4", "PF0": "A5",
    "PB1": "SCK", "PB2": "MOSI", "PB3": "MISO",
}  # fmt: skip


def board(name: str) -> WiredBoard:
    return next(one for one in boards() if one.name == name)


def device(of: str, name: str) -> Device:
    return next(one for one in board(of).devices if one.name == name)


def with_device(name: str, new: Device) -> WiredBoard:
    old = board(name)
    return replace(old, devices=tuple(new if one.name == new.name else one for one in old.devices))


def test_each_pin_is_the_firmwares() -> None:
    for pin in pins():
        source = (FIRMWARE / pin.file).read_text()
        defined = re.search(rf"#define {pin.define} (.*)", source)
        assert defined, pin.define
        assert f"BIT({pin.port})" in defined[1], pin
        assert ON_MICRO[pin.port] == pin.board


def test_the_firmware_uses_no_pin_that_is_not_in_the_table() -> None:
    """Every BIT(Pxn) of the drivers, but for SS, which is wired to nothing."""
    sources = "".join((FIRMWARE / "avr" / name).read_text() for name in ("spi.c", "twi.c", "capture.c"))
    assert set(re.findall(r"BIT\((P[BCDEF]\d)\)", sources)) - {"PB0"} == {pin.port for pin in pins()}


def test_the_chip_selects_are_in_the_order_of_the_chips() -> None:
    """spi.c shifts BIT(PB4) by the chip's number; D8 is also the foot's."""
    chips = re.search(r"enum chip \{(.*?)\}", (FIRMWARE / "board.h").read_text())
    assert chips
    names = [name.strip().removeprefix("CHIP_") for name in chips[1].split(",")]
    ports = {net: pin.port for pin in pins() for net in pin.nets}
    assert "BIT(PB4) << chip" in (FIRMWARE / "avr/spi.c").read_text()
    assert [ports[f"CS_{name}"] for name in names[:3]] == ["PB4", "PB5", "PB6"]


def test_the_i2c_addresses_are_the_firmwares() -> None:
    notes = " ".join(one.note for one in board("papers").devices)
    sources = "".join((FIRMWARE / name).read_text() for name in ("srf02.c", "srf02.h", "cmps10.c"))
    for address in re.findall(r"0x[0-9A-F]{2}", notes):
        assert re.search(rf"{address}u?\b", sources, flags=re.I), address


@pytest.mark.parametrize("name", ["papers", "2026", "foot"])
def test_the_nets_are_sound(name: str) -> None:
    assert problems(board(name)) == []


def test_bad_wiring_is_found() -> None:
    barometer, thigh, ranger = device("papers", "barometer"), device("2026", "thigh"), device("2026", "right ranger")
    cases = {
        "3.3V is wired to 5V": with_device("papers", replace(barometer, pins=barometer.pins | {"3.3V": "5V"})),
        "pin SCK withstands 3.6 V": with_device("papers", replace(barometer, pins=barometer.pins | {"SCK": "SCK"})),
        "pin CS is not wired": with_device("2026", replace(thigh, pins={"VIN": "5V", "GND": "GND"})),
        "net CS_THIHG: it ends nowhere": with_device("2026", replace(thigh, pins=thigh.pins | {"CS": "CS_THIHG"})),
        "it has several drivers": with_device("2026", replace(thigh, pins=thigh.pins | {"DO": "CS_CALF"})),
        "pin I2 must stay open": with_device("2026", replace(thigh, pins=thigh.pins | {"I2": "SCK"})),
        "it has no pin C5": with_device("2026", replace(thigh, pins=thigh.pins | {"C5": "SCK"})),
        "ground pin GND is wired to 5V": with_device("2026", replace(thigh, pins=thigh.pins | {"GND": "5V"})),
        "net ECHO_R: the bootloader drives PC7 for its LED: 1 kohm in series is missing": with_device(
            "2026", replace(ranger, pins=ranger.pins | {"Echo": "ECHO_R"})
        ),
        "2026, net ECHO_L_1K: it ends nowhere": without("2026", "left Echo resistor"),
        # an ADIS16100 beside breakout boards of 2026: what the README says of mixed kits
        "thigh, pin DO withstands 3.6 V, another drives 5 V": with_device("2026", device("papers", "calf")),
    }
    for words, bad in cases.items():
        assert any(words in text for text in problems(bad)), (words, problems(bad))


def without(of: str, name: str) -> WiredBoard:
    return replace(board(of), devices=tuple(one for one in board(of).devices if one.name != name))


def test_miso_rests_at_a_one_by_its_resistor() -> None:
    """Without it, between the processor's thresholds: what tools/twin plays by default."""
    for name, least, most in (("2026", 1.02, 1.29), ("foot", 0.83, 1.67)):
        bare = without(name, "pull-up of MISO")
        assert [round(idle_v(bare, "MISO", ohm), 2) for ohm in reversed(PULL_UP_OHM)] == [least, most]
        assert any("net MISO: it rests between the processor's thresholds" in text for text in problems(bare))
        assert min(idle_v(board(name), "MISO", ohm) for ohm in PULL_UP_OHM) > HIGH_MIN_V
    source = (FIRMWARE.parent / "tools/twin/mcu/miso.c").read_text()
    ohms = {ohm for one in boards() for device in one.devices for _, ohm in device.symbol.pulls.values()}
    assert ohms == {float(re.findall(r"#define BOARD_OHM ([\d.]+)", source)[0])}


@pytest.mark.parametrize("kit", ["papers", "2026"])
def test_each_role_has_a_part_with_an_order_number(kit: str) -> None:
    rows = [row for row in hardware.parts() if kit in row["kits"]]
    assert {"processor board", "side rangers", "thigh, calf, belt", "pressure", "compass", "foot"} <= {
        row["role"] for row in rows
    }
    for row in rows:
        assert row["count"][kit] > 0
        assert 0 < row["eur"] <= 2000
        assert row["order"]
        assert (row["source"] in ("maker", "lists")) == ("seen" in row)
        assert row["source"] in hardware.SEEN
    boards_of = {"papers": ["papers"], "2026": ["2026", "foot"]}[kit]
    processors = [row["count"][kit] for row in rows if row["role"].startswith("processor board")]
    assert sum(processors) == len(boards_of)


@pytest.mark.parametrize("name", ["papers", "2026", "foot"])
def test_a_drawing_has_every_wire_and_no_text_beyond_its_box(name: str) -> None:
    """A letter of a bold 13-pixel label is at most 8.5 pixels wide on average [DejaVu Sans Bold]."""
    svg = (FIRMWARE / f"hardware/drawings/wiring-{name}.svg").read_text()
    for one in board(name).devices:
        title = f"{one.name}: {one.symbol.title}"
        assert title in svg
        assert 8.5 * len(title) < 290.0 - 12.0, title
        for net in one.wires().values():
            label = board(name).pins[net].board if net in board(name).pins else net
            assert f">{label}</text>" in svg, net


def test_the_readme_comes_in_the_order_of_the_work() -> None:
    order = [
        "## What to order",
        "## How to wire it",
        "## How to build it",
        "## How to wear it",
        "## What `status` counts",
    ]
    places = [README.index(f"\n{title}") for title in order]
    assert places == sorted(places)
    for title in order[:3]:
        assert "*Not built yet" in README.partition(f"\n{title}")[2][:200], title
    guide = README.partition("\n## How to build it")[2].partition("\n### ")[0]
    assert re.findall(r"^(\d+)\. ", guide, flags=re.M) == [str(k) for k in range(1, 11)]


def guide_step(number: int) -> list[str]:
    """Lines of the output that a step shows."""
    step = README.partition("\n## How to build it")[2].partition(f"\n{number}. ")[2].partition(f"\n{number + 1}. ")[0]
    shown = "".join(re.findall(r"```\n(.*?)```", step, flags=re.S))
    return [line.strip() for line in shown.splitlines() if line.strip()]


def standing_foot(milliseconds: int) -> NDArray[Any]:
    """Inputs of a foot board at rest, in counts: 1 g along z, a rate of one count."""
    rows = np.zeros(milliseconds, EXTENDED_ROW)
    rows["row"]["sync_us"], rows["row"]["temperature"] = NO_SYNC, 400
    rows["motion"]["rate"][:, 0], rows["motion"]["force"][:, 0] = (1, 0, 0), (0, 0, 1_024)
    return rows


LEGS = ("imu_thigh=absent", "imu_calf=absent")
RANGERS = ("pulse_left=absent", "pulse_right=absent")


@pytest.mark.long
@needs_twin
@pytest.mark.parametrize(
    ("step", "faults"),
    [
        (2, (*RANGERS, "lis3mdl=absent", *LEGS, "imu_belt=absent", "bmp390=absent")),
        (4, (*RANGERS, "lis3mdl=absent", *LEGS)),
        (6, RANGERS),
        (7, ()),
    ],
)
def test_a_step_of_the_guide_shows_what_the_doctor_prints(step: int, faults: tuple[str, ...]) -> None:
    with twin_board("kit=2026", *faults) as port:
        printed = echostep("doctor", "--board", port, "--seconds", 5).stdout
    lines = [line.strip() for line in printed.splitlines()]
    for shown in guide_step(step):
        if shown.startswith("rates"):
            rates = dict(re.findall(r"(\w+) ([\d.]+)/s", shown))
            measured = dict(re.findall(r"(\w+) ([\d.]+)/s", printed))
            assert {name: float(rate) for name, rate in measured.items()} == {
                name: pytest.approx(float(rate), rel=0.05) for name, rate in rates.items()
            }
        else:
            assert shown in lines, (shown, printed)
    assert guide_step(step)


@pytest.mark.long
@needs_twin
def test_the_step_of_the_foot_board_shows_what_the_doctor_prints() -> None:
    with twin_board("kit=2026") as board_port, twin_board("kit=foot", rows=standing_foot) as port:
        printed = echostep("doctor", "--board", board_port, "--foot", port, "--seconds", 5).stdout
    foot, rates = guide_step(8)
    assert foot in printed, printed
    (rate,) = re.findall(r"foot ([\d.]+)/s", rates)
    (measured,) = re.findall(r"foot ([\d.]+)/s", printed)
    assert float(measured) == pytest.approx(float(rate), rel=0.05)
    assert rates.partition(";")[2] in printed
