/* SPDX-License-Identifier: GPL-3.0-or-later
 * Compass of the CMPS10 class on I2C: version in register 0, bearing 0-3599 in registers 2 and 3. */
#include "parts/parts.h"

enum { BAD_VALUE = OTHER_TWI_FAULTS };
#define VERSION 13

static struct register_file chips[] = {
	{ .twi = { .part = PART(compass, PLACE_COMPASS, "compass"), .address = 0x60 }, .counts_up = true },
};

static int get(void *self, uint8_t at)
{
	if (chips->part.fault.value == BAD_VALUE)
		return 0xFF;
	switch (at) {
	case 0: return VERSION;
	case 1: return (uint8_t)(input.row.bearing * 256u / 3600u);
	case 2: return input.row.bearing >> 8;
	case 3: return (uint8_t)input.row.bearing;
	default: return 0;
	}
}

const struct model compass = {
	.kind = OF_PAPERS,
	.faults = "ok absent nack stretch bad_value",
	PARTS(chips),
	.write = registers_write,
	.read = registers_read,
	.get = get,
	.address_mask = 0xFF,
	.fault_stretch_us = 500,
};
