/* SPDX-License-Identifier: GPL-3.0-or-later
 * Registers of the ATmega32U4 that simavr lacks or has wrongly: JTAG, the signature row, the flags of Timer1 and
 * Timer3.
 *
 * JTAG, where its fuse is programmed, owns PF4 to PF7 (A3 to A0) until the program has written a one to JTD of MCUCR
 * twice within four cycles [data sheet, chapter 26.5.1]. Boards are sold with the fuse unprogrammed.
 *
 * The signature row holds the chip's own number, another one for each seed. An LPM within three cycles of a write to
 * SPMCSR reads it; simavr knows only flash. The vectors there are of interrupts that the firmware does not use.
 *
 * A one that is written to a timer's flag register clears its flag, and no other [14.10.18]. simavr 1.6 clears every
 * flag that is set, so that an overflow during a capture's interrupt was lost. A flag that is set already interrupts
 * when its interrupt is enabled [chapter 9]; in simavr it is forgotten. */
#include <string.h>

#include <simavr/sim_cycle_timers.h>
#include <simavr/sim_interrupts.h>

#include "twin.h"

enum { MCUCR = 0x55, JTD = 0x80 };
enum { SPMCSR = 0x57, SIGRD_SPMEN = 0x21 };
enum { TIFR1 = 0x36, TIFR3 = 0x38, TIMSK1 = 0x6F, TIMSK3 = 0x71, OCF1A = 1, ICF1 = 5, FLAGS = 6 };
#define JTD_WITHIN_CYCLES 4
#define SIGNATURE 0x0E
#define SIGNATURE_SIZE 10

FAULT_SWITCH(jtag_fuse, "unprogrammed programmed", NULL, 0)

static bool jtag_off;
static avr_cycle_count_t written_until; /* the second write of JTD must come by then */
static uint8_t signature[SIGNATURE_SIZE], vectors[SIGNATURE_SIZE];
static const int vectors_1[FLAGS] = { 20, 17, 18, 19, 0, 16 }; /* TOV, OCFA, OCFB, OCFC, -, ICF */
static const int vectors_3[FLAGS] = { 35, 32, 33, 34, 0, 31 };

static void write_mcucr(avr_t *a, avr_io_addr_t address, uint8_t value, void *param)
{
	a->data[address] = value;
	if (!(value & JTD)) {
		written_until = 0;
		return;
	}
	jtag_off = jtag_off || a->cycle <= written_until;
	written_until = a->cycle + JTD_WITHIN_CYCLES;
}

bool jtag_owns_analog_pins(void)
{
	return jtag_fuse.value && !jtag_off;
}

static avr_cycle_count_t hide_signature(avr_t *a, avr_cycle_count_t when, void *param)
{
	memcpy(avr->flash + SIGNATURE, vectors, sizeof vectors);
	return 0;
}

static void write_spmcsr(avr_t *a, avr_io_addr_t address, uint8_t value, void *param)
{
	if (value != SIGRD_SPMEN)
		return;
	memcpy(a->flash + SIGNATURE, signature, sizeof signature);
	avr_cycle_timer_register(a, 3, hide_signature, NULL);
}

static void write_flags(avr_t *a, avr_io_addr_t address, uint8_t value, void *param)
{
	const int *numbers = address == TIFR1 ? vectors_1 : vectors_3;

	for (int k = 0; k < FLAGS; k++)
		if (numbers[k] && (value & (1u << k)))
			avr_clear_interrupt(a, vector(numbers[k]));
}

static void write_mask(avr_t *a, avr_io_addr_t address, uint8_t value, void *param)
{
	const int *numbers = address == TIMSK1 ? vectors_1 : vectors_3;
	uint8_t flags = a->data[address == TIMSK1 ? TIFR1 : TIFR3];

	a->data[address] = value;
	for (int k = 0; k < FLAGS; k++)
		if (numbers[k] && (value & flags & (1u << k)))
			avr_raise_interrupt(a, vector(numbers[k]));
}

/* After the bootloader's timer, whose capture input has seen a falling edge. */
void timer_flags_left_over(void)
{
	avr_raise_interrupt(avr, vector(vectors_1[OCF1A]));
	avr_raise_interrupt(avr, vector(vectors_1[ICF1]));
}

void chip_reset(void)
{
	jtag_off = false;
	written_until = 0;
}

void chip_init(void)
{
	uint64_t number = random_state * 0x9E3779B97F4A7C15ull;

	for (unsigned k = 0; k < SIGNATURE_SIZE; k++)
		signature[k] = (uint8_t)(number >> (k % 8 * 8) ^ k);
	memcpy(vectors, avr->flash + SIGNATURE, sizeof vectors);
	take_register(MCUCR, NULL, write_mcucr);
	take_register(SPMCSR, NULL, write_spmcsr);
	take_register(TIMSK1, NULL, write_mask);
	take_register(TIMSK3, NULL, write_mask);
	take_register(TIFR1, NULL, write_flags);
	take_register(TIFR3, NULL, write_flags);
}
