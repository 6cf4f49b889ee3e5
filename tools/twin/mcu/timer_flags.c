/* SPDX-License-Identifier: GPL-3.0-or-later
 * Flag registers of Timer1 and Timer3 [ATmega32U4 data sheet, 14.10.18]: a one that is written clears its flag, and no other. simavr 1.6 clears
 * every flag that is set, so that an overflow during a capture's interrupt was lost. */
#include <simavr/sim_interrupts.h>

#include "twin.h"

enum { TIFR1 = 0x36, TIFR3 = 0x38 };
enum { FLAGS = 6 };
static const int vectors_1[FLAGS] = { 20, 17, 18, 19, 0, 16 }; /* TOV, OCFA, OCFB, OCFC, -, ICF */
static const int vectors_3[FLAGS] = { 35, 32, 33, 34, 0, 31 };

static void write_flags(avr_t *a, avr_io_addr_t address, uint8_t value, void *param)
{
	const int *vectors = address == TIFR1 ? vectors_1 : vectors_3;

	(void)param;
	for (int k = 0; k < FLAGS; k++)
		if (vectors[k] && (value & (1u << k)))
			avr_clear_interrupt(a, vector(vectors[k]));
}

void timer_flags_init(void)
{
	take_register(TIFR1, NULL, write_flags);
	take_register(TIFR3, NULL, write_flags);
}
