/* SPDX-License-Identifier: GPL-3.0-or-later
 * Compass of the CMPS10 class on I2C: version in register 0, bearing 0-3599 in registers 2 and 3. */
#include <string.h>

#include "twin.h"

#define VERSION 13

static struct twi_device twi;
static bool absent, fresh;
static uint8_t pointer;

static bool on_start(struct twi_device *self, bool read)
{
	(void)self;
	fresh = !read;
	return !absent;
}

static bool on_write(struct twi_device *self, uint8_t byte)
{
	(void)self;
	if (fresh)
		pointer = byte;
	fresh = false;
	return true;
}

static uint8_t on_read(struct twi_device *self)
{
	(void)self;
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
	absent = !strcmp(value, "absent");
	return absent || !strcmp(value, "ok");
}
