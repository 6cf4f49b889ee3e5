/* SPDX-License-Identifier: GPL-3.0-or-later
 * Compass of the CMPS10 class on I2C: version in register 0, bearing 0-3599 in registers 2 and 3. */
#include <string.h>

#include "twin.h"

#define VERSION 13
#define STRETCHED US(500)

static struct twi_device twi;
static enum fault { GOOD, ABSENT, NACK, STRETCH, BAD_VALUE, FAULTS } fault;
static const char *const fault_names[FAULTS] = { "ok", "absent", "nack", "stretch", "bad_value" };
static bool fresh;      /* the next byte written is a register's number */
static uint8_t pointer; /* register of the next read */

static bool on_start(struct twi_device *self, bool read)
{
	fresh = !read;
	self->stretch = fault == STRETCH ? STRETCHED : 0;
	return fault != ABSENT && kit_of_papers(PLACE_COMPASS);
}

static bool on_write(struct twi_device *self, uint8_t byte)
{
	(void)self;
	if (fresh)
		pointer = byte;
	fresh = false;
	return fault != NACK;
}

static uint8_t on_read(struct twi_device *self)
{
	(void)self;
	if (fault == BAD_VALUE) {
		pointer++;
		return 0xFF;
	}
	switch (pointer++) {
	case 0: return VERSION;
	case 1: return (uint8_t)(row.bearing * 256u / 3600u);
	case 2: return (uint8_t)(row.bearing >> 8);
	case 3: return (uint8_t)row.bearing;
	default: return 0;
	}
}

void compass_power(void)
{
	if (!twi.start) {
		twi = (struct twi_device){ 0x60, on_start, on_write, on_read, NULL, 0, NULL };
		twi_add(&twi);
	}
}

bool compass_fault(const char *name, const char *value)
{
	if (strcmp(name, "compass"))
		return false;
	for (int f = 0; f < FAULTS; f++)
		if (!strcmp(value, fault_names[f])) {
			fault = (enum fault)f;
			return true;
		}
	return false;
}
