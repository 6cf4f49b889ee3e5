/* SPDX-License-Identifier: GPL-3.0-or-later
 * Fault switches `name=value` of the bench protocol (README.md), each to the model that has it. */
#include <stdlib.h>
#include <string.h>

#include "twin.h"

static bool usb_fault(const char *name, const char *value)
{
	if (!strcmp(name, "usb_errors"))
		return usb_cable_errors(value);
	if (strcmp(name, "usb"))
		return false;
	if (!strcmp(value, "unplug"))
		board_power(false);
	else if (!strcmp(value, "plug"))
		board_power(true);
	else if (!strcmp(value, "reset"))
		usb_host_reset();
	else if (!strcmp(value, "suspend"))
		usb_host_suspend(true);
	else if (!strcmp(value, "resume"))
		usb_host_suspend(false);
	else if (!strcmp(value, "configure"))
		usb_host_configure();
	else if (!strcmp(value, "interface"))
		usb_host_interface();
	else if (!strcmp(value, "touch") || !strcmp(value, "twiggle"))
		usb_host_touch(!strcmp(value, "twiggle"));
	else
		return false;
	return true;
}

static bool host_fault(const char *name, const char *value)
{
	if (!strcmp(name, "host_system"))
		return usb_host_system(value);
	if (!strcmp(name, "host_hub"))
		return usb_hub_fault(value);
	if (strcmp(name, "host"))
		return false;
	usb_host_stall(!strcmp(value, "stall"));
	return !strcmp(value, "stall") || !strcmp(value, "read");
}

static bool bus_fault(const char *name, const char *value)
{
	bool ok = !strcmp(value, "ok"), forever = !strcmp(value, "stuck_forever"), stuck = !strcmp(value, "stuck");

	if (!strcmp(name, "scl") && (ok || stuck)) {
		twi_fault(stuck ? TWI_CLOCK_STUCK : TWI_GOOD);
		return true;
	}
	if (strcmp(name, "sda") || !(ok || stuck || forever))
		return false;
	twi_fault(forever ? TWI_STUCK_FOREVER : stuck ? TWI_STUCK : TWI_GOOD);
	return true;
}

static bool other_fault(const char *name, const char *value)
{
	if (!strcmp(name, "crystal"))
		return clock_fault(value);
	if (!strcmp(name, "spi_errors"))
		return spi_errors(value);
	if (!strcmp(name, "twi_errors"))
		return twi_errors(value);
	if (!strcmp(name, "hum"))
		return floating_hum(value);
	if (!strcmp(name, "glitch"))
		return pulse_glitch(value);
	return !strcmp(name, "swapped") && bench_swap(value);
}

void switch_fault(char *text)
{
	char *value = strchr(text, '=');

	if (!value)
		fail("fault '%s' is not name=value", text);
	*value++ = 0;
	bool (*const models[])(const char *, const char *) = {
		usb_fault, host_fault, bus_fault, other_fault, board_fault, srf02_fault, adis16100_fault, scp1000_fault, compass_fault,
		kit_fault, bmp390_fault, pulse_fault, maxsonar_fault, lsm6dso_fault, lis3mdl_fault, icm20649_fault, miso_fault,
	};
	for (unsigned k = 0; k < sizeof models / sizeof *models; k++)
		if (models[k](text, value))
			return;
	fail("there is no fault %s=%s; see tools/twin/README.md", text, value);
}
