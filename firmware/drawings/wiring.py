# SPDX-License-Identifier: MIT
"""Drawing of the sensor board's wiring: python firmware/drawings/wiring.py > firmware/drawings/wiring.svg

In: nothing; the pins are those of the table in firmware/README.md. Out: SVG on standard output. Owns the layout.
"""

from __future__ import annotations

import sys

from pen import SOFT, Pen

I2C, CLOCK, OUT, IN, SELECT, TEST, SYNC, V5, V33 = (
    "#0b62d6", "#c2410c", "#b45309", "#15803d", "#6b7280", "#7c3aed", "#be185d", "#d1242f", "#8250df",
)  # fmt: skip
BOARD_LEFT, BOARD_RIGHT = 470, 690
RAILS = {"SCK": (740, CLOCK), "MOSI": (760, OUT), "MISO": (780, IN), "ST1": (880, TEST), "ST2": (900, TEST)}
RIGHT_PINS = {
    "SCK": (150, "ICSP  SCK"), "MOSI": (180, "ICSP  MOSI"), "MISO": (210, "ICSP  MISO"),
    "thigh": (270, "D8"), "calf": (311, "D9"), "belt": (352, "D10"),
    "ST1": (394, "A0"), "ST2": (424, "A1"), "pressure": (590, "D6"), "DRDY": (620, "D7"),
}  # fmt: skip
LANES = {"thigh": 810, "calf": 830, "belt": 850}
GYRO_TOPS = {"thigh": 90, "calf": 245, "belt": 400}
GYRO_PINS = ("SCLK", "DIN", "DOUT", "CS", "ST1", "ST2")
BUS_OF_PIN = {"SCLK": "SCK", "DIN": "MOSI", "DOUT": "MISO", "ST1": "ST1", "ST2": "ST2"}


def main() -> None:
    pen = Pen(1240, 830, "Wiring of the echostep sensor board")
    pen.label(30, 40, "Wiring of the sensor board", 22, bold=True)
    pen.label(
        30,
        62,
        "Every 5 V tag goes to the board's 5V pin, every GND tag to its GND; 100 nF at every chip. Dots are joints.",
        13,
        ink=SOFT,
    )
    _board(pen)
    _i2c(pen)
    _sync(pen)
    _gyros(pen)
    _barometer(pen)
    sys.stdout.write(pen.svg())


def _tag(pen: Pen, x: float, y: float, text: str) -> None:
    """Label a supply pin, in the color of its voltage."""
    ink = V5 if text.startswith("5") else V33 if text.startswith("3") else "#1b1f24"
    pen.label(x, y, text, 12, "middle", ink, bold=True)


def _board(pen: Pen) -> None:
    pen.box(BOARD_LEFT, 90, BOARD_RIGHT - BOARD_LEFT, 660, "#e8f1fb")
    pen.label(580, 470, "ATmega32U4", 18, "middle", bold=True)
    for k, line in enumerate(("5 V, 16 MHz, Caterina", "Leonardo, Micro, Pro Micro 5 V")):
        pen.label(580, 494 + 18 * k, line, 12, "middle", SOFT)
    pen.box(540, 740, 80, 34, "#ffffff")
    pen.label(580, 762, "USB", 13, "middle", bold=True)
    pen.label(580, 796, "to the host", 12, "middle", SOFT)
    for y, text in ((200, "D2  SDA"), (230, "D3  SCL"), (640, "D4  ICP1")):
        pen.label(BOARD_LEFT + 8, y + 4, text, 12)
    for y, text in RIGHT_PINS.values():
        pen.label(BOARD_RIGHT - 8, y + 4, text, 12, "end")


def _i2c(pen: Pen) -> None:
    pen.wire([(BOARD_LEFT, 200), (380, 200), (380, 110)], I2C)
    pen.wire([(380, 200), (380, 480)], I2C)
    pen.wire([(BOARD_LEFT, 230), (410, 230), (410, 110)], I2C)
    pen.wire([(410, 230), (410, 510)], I2C)
    for x in (380, 410):
        pen.box(x - 7, 116, 14, 40, "#ffffff", I2C)
        pen.dot(x, 200 if x == 380 else 230, I2C)
    pen.label(395, 104, "5 V", 12, "middle", V5, bold=True)
    pen.label(425, 141, "2.2k", 11, ink=SOFT)
    pen.label(366, 141, "2.2k", 11, "end", SOFT)
    for top, name, note in (
        (110, "SRF02, left", "0x70, Mode open"),
        (260, "SRF02, right", "0x71, Mode open"),
        (410, "CMPS10", "compass, 0x60"),
    ):
        pen.box(60, top, 210, 120)
        pen.label(76, top + 48, name, 15, bold=True)
        pen.label(76, top + 68, note, 12, ink=SOFT)
        for pin, y, rail in (("SDA", top + 70, 380), ("SCL", top + 100, 410)):
            pen.label(262, y + 4, pin, 12, "end")
            pen.wire([(270, y), (rail, y)], I2C)
            pen.dot(rail, y, I2C)
        pen.label(262, top + 24, "5 V", 12, "end", V5, bold=True)
        pen.label(262, top + 46, "GND", 12, "end", bold=True)


def _sync(pen: Pen) -> None:
    pen.box(60, 590, 120, 100)
    pen.label(72, 622, "MTx", 15, bold=True)
    pen.label(72, 642, "on the foot", 12, ink=SOFT)
    pen.label(172, 664, "SyncOut", 12, "end")
    pen.label(172, 682, "GND", 12, "end", bold=True)
    pen.wire([(180, 660), (240, 660)], SYNC)
    pen.dot(205, 660, SYNC)
    pen.wire([(205, 660), (205, 740)], SYNC)
    pen.box(198, 690, 14, 36, "#ffffff", SYNC)
    pen.label(192, 712, "10k", 11, "end", SOFT)
    _tag(pen, 205, 758, "GND")
    pen.shape("M240 630 L310 660 L240 690 Z", "#ffffff", "#1b1f24")
    pen.label(275, 614, "74AHCT1G125", 12, "middle", bold=True)
    pen.label(268, 704, "OE to GND", 11, "middle", SOFT)
    _tag(pen, 322, 640, "5 V")
    pen.wire([(310, 660), (430, 660), (430, 640), (BOARD_LEFT, 640)], SYNC)
    pen.label(320, 680, "3.3 V pulses become 5 V", 11, ink=SOFT)


def _gyros(pen: Pen) -> None:
    bottom = {"SCK": 690, "MOSI": 710, "MISO": 750, "ST1": 499, "ST2": 520}
    top_of = {"SCK": 105, "MOSI": 126, "MISO": 147, "ST1": 189, "ST2": 210}
    for name, (x, ink) in RAILS.items():
        y = RIGHT_PINS[name][0]
        pen.wire([(BOARD_RIGHT, y), (x, y)], ink)
        pen.wire([(x, top_of[name]), (x, bottom[name])], ink)
        pen.dot(x, y, ink)
    for name, top in GYRO_TOPS.items():
        pen.box(960, top, 220, 135)
        pen.label(1030, top + 40, "ADIS16100", 15, bold=True)
        pen.label(1030, top + 60, name, 14)
        pen.label(1030, top + 86, "5 V (VCC, VDRIVE)", 12, ink=V5, bold=True)
        pen.label(1030, top + 106, "GND", 12, bold=True)
        for k, pin in enumerate(GYRO_PINS):
            y = top + 15 + 21 * k
            pen.label(968, y + 4, pin, 11)
            if pin == "CS":
                start, lane = RIGHT_PINS[name][0], LANES[name]
                pen.wire([(BOARD_RIGHT, start), (lane, start), (lane, y), (960, y)], SELECT)
            else:
                x, ink = RAILS[BUS_OF_PIN[pin]]
                pen.wire([(x, y), (960, y)], ink)
                pen.dot(x, y, ink)


def _barometer(pen: Pen) -> None:
    pen.box(860, 560, 110, 215, "#fff8e6")
    pen.label(915, 585, "level shifter", 12, "middle", bold=True)
    pen.label(915, 602, "4 x BSS138", 11, "middle", SOFT)
    pen.label(868, 626, "HV 5 V", 10, ink=V5, bold=True)
    pen.label(962, 626, "LV 3.3 V", 10, "end", V33, bold=True)
    pen.box(1060, 590, 130, 200)
    pen.label(1182, 616, "SCP1000-D01", 14, "end", bold=True)
    pen.label(1182, 634, "barometer", 12, "end", SOFT)
    pen.label(1182, 750, "3.3 V only", 12, "end", V33, bold=True)
    pen.label(1182, 770, "GND", 12, "end", bold=True)
    for k, (name, y, ink) in enumerate(
        (("SCK", 690, CLOCK), ("MOSI", 710, OUT), ("CSB", 650, SELECT), ("MISO", 750, IN))
    ):
        if name == "CSB":
            pen.wire([(BOARD_RIGHT, 590), (830, 590), (830, y), (860, y)], ink)
        else:
            pen.wire([(RAILS[name][0], y), (860, y)], ink)
        pen.wire([(970, y), (1060, y)], ink)
        pen.label(1068, y + 4, name, 11)
        pen.label(868, y + 4, f"H{k + 1}", 10, ink=SOFT)
        pen.label(962, y + 4, f"L{k + 1}", 10, "end", SOFT)
    pen.wire([(BOARD_RIGHT, 620), (715, 620), (715, 800), (1030, 800), (1030, 778), (1060, 778)], SYNC)
    pen.label(1068, 782, "DRDY", 11)
    pen.label(760, 818, "DRDY goes straight to D7: 3.3 V is above its threshold of 3.0 V", 11, ink=SOFT)


if __name__ == "__main__":
    main()
