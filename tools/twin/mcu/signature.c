/* SPDX-License-Identifier: GPL-3.0-or-later
 * The chip's own number in its signature row, another one for each seed. */
#include <string.h>

#include <simavr/sim_cycle_timers.h>

#include "twin.h"

enum { SPMCSR = 0x57, SIGRD_SPMEN = 0x21 };
#define SIGNATURE 0x0E
#define SIGNATURE_SIZE 10

static uint8_t signature[SIGNATURE_SIZE], vectors[SIGNATURE_SIZE];

/* An LPM within three cycles of this write reads the signature row; simavr knows only flash. The vectors there are of interrupts that the
 * firmware does not use. */
static avr_cycle_count_t hide_signature(avr_t *a, avr_cycle_count_t when, void *param)
{
	(void)a;
	(void)when;
	(void)param;
	memcpy(avr->flash + SIGNATURE, vectors, sizeof vectors);
	return 0;
}

static void write_spmcsr(avr_t *a, avr_io_addr_t address, uint8_t value, void *param)
{
	(void)address;
	(void)param;
	if (value != SIGRD_SPMEN)
		return;
	memcpy(a->flash + SIGNATURE, signature, sizeof signature);
	avr_cycle_timer_register(a, 3, hide_signature, NULL);
}

void signature_init(void)
{
	uint64_t number = random_state * 0x9E3779B97F4A7C15ull;

	for (unsigned k = 0; k < SIGNATURE_SIZE; k++)
		signature[k] = (uint8_t)(number >> (k % 8 * 8) ^ k);
	memcpy(vectors, avr->flash + SIGNATURE, sizeof vectors);
	take_register(SPMCSR, NULL, write_spmcsr);
}
