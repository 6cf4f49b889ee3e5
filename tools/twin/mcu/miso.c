/* SPDX-License-Identifier: GPL-3.0-or-later
 * The level of MISO while no part drives it, by the resistors on it: the processor's pull-up, and those of the boards that are plugged in [nets of
 * the makers' Eagle files: Adafruit 4438 R2 SDO-GND, 4464 R1 AD0-GND, 4816 R4 SDO-3.3V, 757 10 kohm to either supply].
 *
 * An input reads a zero up to 0.2 VCC - 0.1 V and a one from 0.2 VCC + 0.9 V on [ATmega32U4 data sheet, table 29-1, from memory]. Between the two
 * it may read either, or change from bit to bit: the fault `miso_undefined` chooses. */
#include <string.h>

#include "twin.h"

#define PROCESSOR_OHM 35000.0 /* pull-up of 20 to 50 kohm [table 29-1] */
#define BOARD_OHM 10000.0
#define SUPPLY_V 5.0
#define LOW_MAX_V (0.2 * SUPPLY_V - 0.1)
#define HIGH_MIN_V (0.2 * SUPPLY_V + 0.9)
#define MISO 3 /* of port B */

static enum kind { ZEROS, ONES, NOISE, KINDS } undefined;
static double resistor_ohm; /* between MISO and 3.3 V, 0: none */

/* The Thevenin voltage of all resistors; 0 without any. */
static double idle_volts(void)
{
	double siemens = 0.0, amperes = 0.0;
	unsigned to_ground = lsm6dso_plugged() + icm20649_plugged();

	if (pin_is_pulled_up('B', MISO)) {
		siemens += 1.0 / PROCESSOR_OHM;
		amperes += SUPPLY_V / PROCESSOR_OHM;
	}
	if (kit_of_papers(PLACE_PRESSURE)) { /* the level shifter */
		siemens += 1.0 / BOARD_OHM;
		amperes += SUPPLY_V / BOARD_OHM;
	}
	if (bmp390_plugged()) {
		siemens += 1.0 / BOARD_OHM;
		amperes += 3.3 / BOARD_OHM;
	}
	if (resistor_ohm > 0.0) {
		siemens += 1.0 / resistor_ohm;
		amperes += 3.3 / resistor_ohm;
	}
	siemens += to_ground / BOARD_OHM;
	return siemens > 0.0 ? amperes / siemens : 0.0;
}

uint8_t miso_idle(void)
{
	double volts = idle_volts();

	if (volts <= LOW_MAX_V || (volts < HIGH_MIN_V && undefined == ZEROS))
		return 0x00;
	return volts < HIGH_MIN_V && undefined == NOISE ? (uint8_t)random_below(256) : 0xFF;
}

/* The pin itself, which the program may read while no chip is selected. */
void miso_millisecond(void)
{
	drive_pin('B', MISO, miso_idle() & 1);
}

bool miso_fault(const char *name, const char *value)
{
	static const char *const kinds[KINDS] = { "zeros", "ones", "noise" };

	if (!strcmp(name, "miso_resistor")) { /* to 3.3 V */
		resistor_ohm = !strcmp(value, "2200") ? 2200.0 : 0.0;
		return resistor_ohm > 0.0 || !strcmp(value, "none");
	}
	for (enum kind k = ZEROS; !strcmp(name, "miso_undefined") && k < KINDS; k++)
		if (!strcmp(value, kinds[k])) {
			undefined = k;
			return true;
		}
	return false;
}
