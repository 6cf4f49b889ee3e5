/* SPDX-License-Identifier: GPL-3.0-or-later
 * A processor that hangs: an endless loop replaces the instruction that comes next, until a reset. */
#include <string.h>

#include "twin.h"

#define LOOP_FOREVER 0xCFFFu /* rjmp .-2 */

static enum hang { RUNS, HANGS, HANGS_IN_SPI, HANGS_DEAF } wanted_hang; /* DEAF: in SPI, with interrupts off */
static bool hung;
static uint16_t replaced; /* the instruction under the endless loop */
static avr_flashaddr_t hung_at;

static void put_instruction(avr_flashaddr_t at, uint16_t code)
{
	avr->flash[at] = (uint8_t)code;
	avr->flash[at + 1] = (uint8_t)(code >> 8);
}

void hang_end(void)
{
	if (hung)
		put_instruction(hung_at, replaced);
	hung = false;
	wanted_hang = RUNS;
}

void hang_now(void)
{
	if (hung)
		return;
	hung = true;
	hung_at = avr->pc;
	replaced = (uint16_t)(avr->flash[hung_at] | avr->flash[hung_at + 1] << 8);
	put_instruction(hung_at, LOOP_FOREVER);
	if (wanted_hang == HANGS_DEAF)
		avr->sreg[S_I] = 0;
	bench_trace("hang %04x", hung_at / 2);
	wanted_hang = RUNS;
}

void hang_spi_selected(void)
{
	if (wanted_hang == HANGS_IN_SPI || wanted_hang == HANGS_DEAF)
		hang_now();
}

/* The next millisecond begins. It is the main loop that hangs, not an interrupt: within one of these the next millisecond is awaited. */
void hang_millisecond(void)
{
	if (wanted_hang == HANGS && avr->sreg[S_I])
		hang_now();
}

void hang_soon(void)
{
	wanted_hang = HANGS;
}

bool hang_fault(const char *value)
{
	wanted_hang = !strcmp(value, "hang_in_spi") ? HANGS_IN_SPI : !strcmp(value, "hang_deaf") ? HANGS_DEAF : RUNS;
	return wanted_hang != RUNS || !strcmp(value, "ok");
}
