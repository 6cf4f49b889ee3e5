# SPDX-License-Identifier: MIT
"""Texts on the faults of parts of the kit of 2026, and on parts that the firmware does not know.

In: the part in a place, and the fault that the board reports. Out: faults, each with its remedy. Owns the texts.
"""

from __future__ import annotations

from echostep.board.messages import Fault, Healthy, Part, SelfTest

_SPI = "check its plug, its 5 V and ground, and the SPI wires"
I2C_BITS_REMEDY = "shorten its cable, check the pull-ups, SDA (D2) and SCL (D3)"
WRONG_BITS_REMEDY = "shorten its SPI wires, and put 100 ohm in series into SCK and MOSI at the board"
_AGAIN = "power-cycle the board; if it stays, replace the part"

_BMP390 = {
    Fault.NO_ANSWER: ("does not answer", f"{_SPI}; its chip select is D6"),
    Fault.EEPROM: ("its calibration reads with a wrong check sum", f"{_SPI}; {_AGAIN}"),
    Fault.NEVER_READY: ("has had no sample for 2 s", f"it may have lost its supply for a moment: {_SPI}"),
    Fault.ALWAYS_READY: ("reports a sample that it cannot have yet", f"its data line may be held high: {_SPI}"),
    Fault.BAD_VALUE: ("gives pressures outside of 300 to 1250 hPa", _AGAIN),
}
_PULSE = {
    Fault.NO_ANSWER: (
        "does not answer its trigger",
        "check its 5 V and ground, and that trigger and echo are not exchanged (left A2 and D4, right A3 and D13)",
    ),
    Fault.TOO_LATE: (
        "holds its Echo line high while there is no echo, and had to be pulled low",
        "this module has no timeout of its own and does not fit: use an RCWL-1601",
    ),
    Fault.ALWAYS_READY: (
        "its echo line stays high",
        "check its plug, since the board pulls an open line up, and the line for a short to 5 V (left D4, right D13); "
        "a module without a timeout of its own does not fit",
    ),
}
_MAXSONAR = {
    Fault.BAD_VALUE: (
        "gives ranges above 765 cm, which it cannot measure",
        "its wires may be too long: shorten them, check the pull-ups, SDA (D2) and SCL (D3)",
    ),
}
_LSM6DSO = {
    Fault.NO_ANSWER: ("does not answer", f"{_SPI} and its chip select (thigh D8, calf D9, belt D10)"),
    Fault.NEVER_READY: ("has no new rates", f"it may have lost its supply for a moment: {_SPI}"),
    Fault.BAD_VALUE: ("sent wrong bits", WRONG_BITS_REMEDY),
}
_LIS3MDL = {
    Fault.NO_ANSWER: ("does not answer at I2C address 0x1C or 0x1E", "check its plug and 5 V, SDA (D2) and SCL (D3)"),
    Fault.NEVER_READY: ("has no new field", "it may have lost its supply for a moment: check its plug and 5 V"),
}
_ICM20649 = {
    Fault.NO_ANSWER: ("does not answer", f"{_SPI} and its chip select (D8)"),
    Fault.NEVER_READY: (
        "answers, but its data-ready line does not pulse",
        "check the wire from its INT1 to D4; else it may have lost its supply for a moment: check its plug",
    ),
}
_TRIGGERED = (
    "check its 5 V and ground, Trig ({}) and Echo ({}); of a ranger on I2C, its address 0x{} (firmware/README.md)"
)
UNKNOWN_PART_REMEDIES = {  # of a place in which nothing was found since the start: a part of either kit may be meant
    Healthy.RANGER_LEFT: _TRIGGERED.format("A2", "D4", "70"),
    Healthy.RANGER_RIGHT: _TRIGGERED.format("A3", "D13", "71"),
    Healthy.COMPASS: "check its plug and 5 V, SDA (D2) and SCL (D3)",
    Healthy.PRESSURE: f"{_SPI}; its chip select is D6",
}
_TEXTS: dict[Part, dict[Fault, tuple[str, str]]] = {
    Part.BMP390: _BMP390,
    Part.PULSE: _PULSE,
    Part.MAXSONAR: _MAXSONAR,
    Part.LSM6DSO: _LSM6DSO,
    Part.LIS3MDL: _LIS3MDL,
    Part.ICM20649: _ICM20649,
}
# Identities of the parts that the firmware knows, by place
_WANTED = {Healthy.PRESSURE: "0x60 is a BMP390", Healthy.COMPASS: "0x3D is a LIS3MDL"}
LIKE_FOOT_PARTS = {0xE0: "ICM-20648", 0xE1: "ICM-20649", 0xEA: "ICM-20948"}  # by WHO_AM_I; 0xE0 from memory


SIX_AXES_TESTS = {  # what is wrong and the remedy, by the outcome of the self-test
    SelfTest.FAILED: ("failed its self-test", _AGAIN),
    SelfTest.NO_ANSWER: ("did not answer during its self-test", _SPI),
    SelfTest.MOVED: ("turned during its self-test", "stand still and run echostep doctor"),
}
SIX_AXES_RESPONSES = "-615 to -2870 and 615 to 2870"  # counts, to the negative and the positive sign [LSM6DSO data sheet: 150 to 700 deg/s]
_KINDS = {  # of rangers, in the order in which the firmware prefers them
    Part.MAXSONAR: "a MaxSonar",
    Part.SRF02: "an SRF02",
    Part.PULSE: "a pulse ranger",
}


def mixed_rangers(left: Part, right: Part) -> tuple[str, str]:
    """The fault of rangers of two kinds, and its remedy."""
    what, remedy = "they are of two kinds, and one of them is not used", "plug in two of one kind"
    order = list(_KINDS)
    if left in order and right in order and left != right:
        unused = "left" if order.index(left) > order.index(right) else "right"
        what = f"the left one is {_KINDS[left]}, the right one {_KINDS[right]}; the {unused} one is not used"
    return f"{what}: beam, range and resolution differ", remedy


def foot_text(fault: Fault) -> tuple[str, str]:
    """The fault of a foot board's part, and its remedy."""
    return _ICM20649.get(fault, (f"failed ({fault.name.lower().replace('_', ' ')})", _SPI))


def strange_foot_text(identity: int) -> tuple[str, str]:
    """The fault of a part at the thigh's chip select whose identity is a foot board's, and its remedy."""
    what = f"an {LIKE_FOOT_PARTS[identity]} answers at its chip select (D8, identity register 0x{identity:02X})"
    if identity == 0xE1:
        return f"{what}, but its other registers are not those of one", f"{_AGAIN}; {_SPI}"
    return f"{what}: the firmware does not know it", "plug in an LSM6DSO, or on a foot board an ICM-20649"


def part_text(part: Part, identity: int, device: Healthy, fault: Fault) -> tuple[str, str] | None:
    """The fault of this part and its remedy; None where the general text fits."""
    if part is Part.NONE and identity and device in _WANTED:
        what = f"holds a part that the firmware does not know (identity register 0x{identity:02X})"
        return what, f"plug in a part of firmware/README.md ({_WANTED[device]})"
    return _TEXTS.get(part, {}).get(fault)
