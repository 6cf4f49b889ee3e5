/* SPDX-License-Identifier: GPL-3.0-or-later
 * The level of MISO while no part drives it, by the resistors on it: the processor's pull-up, and those of the boards
 * that are plugged in [nets of the makers' Eagle files: Adafruit 4438 R2 SDO-GND, 4464 R1 AD0-GND, 4816 R4 SDO-3.3V,
 * 757 10 kohm to either supply].
 *
 * An input reads a zero up to 0.2 VCC - 0.1 V and a one from 0.2 VCC + 0.9 V on [ATmega32U4 data sheet, table 29-1,
 * from memory]. Between the two it may read either, or change from bit to bit: the fault `miso_undefined` chooses. */
#include "parts/parts.h"

#define PROCESSOR_OHM 35000.0 /* pull-up of 20 to 50 kohm [table 29-1] */
#define BOARD_OHM 10000.0
#define WIRED_OHM 2200.0
#define SUPPLY_V 5.0
#define LOGIC_V 3.3
#define LOW_MAX_V (0.2 * SUPPLY_V - 0.1)
#define HIGH_MIN_V (0.2 * SUPPLY_V + 0.9)
#define MISO 3 /* of port B */

enum { ZEROS, ONES, NOISE };
FAULT_SWITCH(miso_undefined, "zeros ones noise", NULL, ZEROS)
FAULT_SWITCH(miso_resistor, "none 2200", NULL, 0)

/* The Thevenin voltage of all resistors; 0 without any. */
static double idle_volts(void)
{
	const struct {
		double volts, ohm;
		unsigned count;
	} resistors[] = {
		{ SUPPLY_V, PROCESSOR_OHM, pin_is_pulled_up('B', MISO) },
		{ SUPPLY_V, BOARD_OHM, place_has(PLACE_PRESSURE, OF_PAPERS) }, /* the level shifter */
		{ LOGIC_V, BOARD_OHM, parts_here(&bmp390) },
		{ LOGIC_V, WIRED_OHM, miso_resistor.value },
		{ 0.0, BOARD_OHM, parts_here(&lsm6dso) + parts_here(&icm20649) },
	};
	double siemens = 0.0, amperes = 0.0;

	for (size_t k = 0; k < sizeof resistors / sizeof *resistors; k++) {
		siemens += resistors[k].count / resistors[k].ohm;
		amperes += resistors[k].count * resistors[k].volts / resistors[k].ohm;
	}
	return siemens > 0.0 ? amperes / siemens : 0.0;
}

uint8_t miso_idle(void)
{
	double volts = idle_volts();

	if (volts <= LOW_MAX_V || (volts < HIGH_MIN_V && miso_undefined.value == ZEROS))
		return 0x00;
	return volts < HIGH_MIN_V && miso_undefined.value == NOISE ? (uint8_t)random_below(256) : 0xFF;
}

/* The pin itself, which the program may read while no chip is selected. */
void miso_millisecond(void)
{
	drive_pin('B', MISO, miso_idle() & 1);
}
