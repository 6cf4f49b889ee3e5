/* SPDX-License-Identifier: GPL-3.0-or-later
 * A processor that hangs: an endless loop replaces the instruction that comes next, until a reset. */
#include <string.h>

#include "twin.h"

enum { RUNS, HANGS_IN_SPI, HANGS_DEAF, HANGS }; /* soon; DEAF: in SPI, with interrupts off */
FAULT_SWITCH(cpu, "ok hang_in_spi hang_deaf", NULL, RUNS)

static const uint8_t loop_forever[] = { 0xFF, 0xCF }; /* rjmp .-2 */
static uint8_t replaced[sizeof loop_forever];
static avr_flashaddr_t hung_at;
static bool hung;

void hang_end(void)
{
	if (hung)
		memcpy(avr->flash + hung_at, replaced, sizeof replaced);
	hung = false;
	cpu.value = RUNS;
}

void hang_now(void)
{
	if (hung)
		return;
	hung = true;
	hung_at = avr->pc;
	memcpy(replaced, avr->flash + hung_at, sizeof replaced);
	memcpy(avr->flash + hung_at, loop_forever, sizeof loop_forever);
	if (cpu.value == HANGS_DEAF)
		avr->sreg[S_I] = 0;
	bench_trace("hang %04x", hung_at / 2);
	cpu.value = RUNS;
}

void hang_spi_selected(void)
{
	if (cpu.value == HANGS_IN_SPI || cpu.value == HANGS_DEAF)
		hang_now();
}

/* The next millisecond begins. It is the main loop that hangs, not an interrupt: within one of these the next
 * millisecond is awaited. */
void hang_millisecond(void)
{
	if (cpu.value == HANGS && avr->sreg[S_I])
		hang_now();
}

void hang_soon(void)
{
	cpu.value = HANGS;
}
