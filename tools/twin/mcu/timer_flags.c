/* SPDX-License-Identifier: GPL-3.0-or-later
 * Flag registers of Timer1 and Timer3 [ATmega32U4 data sheet, 14.10.18]: a one that is written clears its flag, and no other. simavr 1.6 clears
 * every flag that is set, so that an overflow during a capture's interrupt was lost. A flag that is set already interrupts when its interrupt is
 * enabled [chapter 9]; in simavr it is forgotten. */
#include <simavr/sim_interrupts.h>

#include "twin.h"

enum { TIFR1 = 0x36, TIFR3 = 0x38, TIMSK1 = 0x6F, TIMSK3 = 0x71 };
enum { OCF1A = 1, ICF1 = 5 };
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

static void write_mask(avr_t *a, avr_io_addr_t address, uint8_t value, void *param)
{
	const int *vectors = address == TIMSK1 ? vectors_1 : vectors_3;
	uint8_t flags = a->data[address == TIMSK1 ? TIFR1 : TIFR3];

	(void)param;
	a->data[address] = value;
	for (int k = 0; k < FLAGS; k++)
		if (vectors[k] && (value & flags & (1u << k)))
			avr_raise_interrupt(a, vector(vectors[k]));
}

/* After the bootloader's timer, whose capture input has seen a falling edge. */
void timer_flags_left_over(void)
{
	avr_raise_interrupt(avr, vector(vectors_1[OCF1A]));
	avr_raise_interrupt(avr, vector(vectors_1[ICF1]));
}

void timer_flags_init(void)
{
	take_register(TIMSK1, NULL, write_mask);
	take_register(TIMSK3, NULL, write_mask);
	take_register(TIFR1, NULL, write_flags);
	take_register(TIFR3, NULL, write_flags);
}
