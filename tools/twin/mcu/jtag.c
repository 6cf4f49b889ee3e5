/* SPDX-License-Identifier: GPL-3.0-or-later
 * JTAG, where its fuse is programmed: it owns PF4 to PF7 (A3 to A0) until the program has written a one to JTD of MCUCR twice within four
 * cycles [ATmega32U4 data sheet, chapter 26.5.1]. Boards are sold with the fuse unprogrammed. */
#include <string.h>

#include "twin.h"

enum { MCUCR = 0x55, JTD = 0x80 };
#define WITHIN_CYCLES 4

static bool fuse, off;
static avr_cycle_count_t written_until; /* the second write must come by then */

static void write_control(avr_t *a, avr_io_addr_t address, uint8_t value, void *param)
{
	(void)param;
	a->data[address] = value;
	if (!(value & JTD)) {
		written_until = 0;
		return;
	}
	off = off || a->cycle <= written_until;
	written_until = a->cycle + WITHIN_CYCLES;
}

bool jtag_owns_analog_pins(void)
{
	return fuse && !off;
}

void jtag_reset(void)
{
	off = false;
	written_until = 0;
}

bool jtag_fault(const char *value)
{
	fuse = !strcmp(value, "programmed");
	return fuse || !strcmp(value, "unprogrammed");
}

void jtag_init(void)
{
	take_register(MCUCR, NULL, write_control);
}
