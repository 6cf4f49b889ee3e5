/* SPDX-License-Identifier: MIT */
/* What survives a reset of the processor: cause and number of its starts, and where it was when it crashed. The
 * variables in .noinit keep their values as long as the memory has power. They lie above the variables of the
 * bootloader Caterina and below its key (size.py). */
#include <avr/interrupt.h> /* ISR */
#include <avr/io.h>        /* registers */
#include <avr/wdt.h>       /* watchdog */
#include <string.h>        /* memset */
#include "../messages.h"   /* RESET_CAUSE_*, CRASH_PLACE_* */
#include "shared.h"

#define VALID 0x5AC3u

static struct {
	uint16_t valid; /* VALID, and its complement at the end: the memory has had power since they were written */
	struct restart known;
	uint8_t place; /* CRASH_PLACE_*, of the main loop now */
	bool hung;     /* the watchdog's interrupt came */
	uint16_t address;
	bool sagging; /* supply, at its newest measurement */
	uint16_t valid_too;
} kept __attribute__((section(".noinit")));

static bool is_kept(void)
{
	return kept.valid == VALID && kept.valid_too == (uint16_t)~VALID;
}

/* The cause when MCUSR is zero, because a bootloader has cleared it. Caterina starts the firmware at once after a loss
 * of power and after a watchdog reset, and else waits for 8 s with its own USB port. */
static uint8_t remembered_cause(bool bootloader_waited)
{
	if (!is_kept())
		return RESET_CAUSE_POWER_ON;
	if (kept.hung)
		return RESET_CAUSE_WATCHDOG;
	if (bootloader_waited)
		return kept.sagging ? RESET_CAUSE_BROWN_OUT : RESET_CAUSE_EXTERNAL;
	/* A crash with interrupts off; or a short loss of power, which most often meets a sleeping processor. */
	return kept.place == CRASH_PLACE_SLEEP ? RESET_CAUSE_POWER_ON : RESET_CAUSE_WATCHDOG;
}

static void note_crash(void)
{
	if (kept.known.crashes < UINT8_MAX)
		kept.known.crashes++;
	kept.known.crash_place = kept.place <= CRASH_PLACE_SLEEP ? kept.place : (uint8_t)CRASH_PLACE_NONE;
	kept.known.crash_address = kept.hung ? kept.address : 0;
}

void restart_begin(uint8_t flags, bool bootloader_waited)
{
	uint8_t cause = flags ? flags : remembered_cause(bootloader_waited);
	if (cause & RESET_CAUSE_POWER_ON)
		cause = RESET_CAUSE_POWER_ON; /* the other flags have no meaning then [data sheet, 8.0.7] */
	if (!is_kept() || cause == RESET_CAUSE_POWER_ON)
		memset(&kept, 0, sizeof kept);
	if (cause & RESET_CAUSE_WATCHDOG)
		note_crash();
	if (kept.known.starts < UINT8_MAX)
		kept.known.starts++;
	kept.known.cause = cause;
	kept.hung = kept.sagging = false;
	kept.place = CRASH_PLACE_START;
	kept.valid = VALID;
	kept.valid_too = (uint16_t)~VALID;
}

void restart_forget(void)
{
	kept.valid = 0;
}

void restart_enter(uint8_t place)
{
	kept.place = place;
}

void restart_note_sag(bool sagging)
{
	kept.sagging = sagging;
}

const struct restart *restart_known(void)
{
	return &kept.known;
}

/* Interrupt after 125 ms without wdt_reset, then reset. Runs before the variables are set (.init3), so that a processor
 * that hangs during its start is restarted too. */
#define CHANGE 0x18    /* WDCE, WDE */
#define INTERRUPT 0x4B /* WDIE, WDE, WDP1, WDP0 */
_Static_assert(CHANGE == (BIT(WDCE) | BIT(WDE)), "WDTCSR");
_Static_assert(INTERRUPT == (BIT(WDIE) | BIT(WDE) | BIT(WDP1) | BIT(WDP0)), "WDTCSR");
#define TEXT_OF(x) #x
#define TEXT(x) TEXT_OF(x)
__asm__(".pushsection .init3, \"ax\", @progbits\n"
	"	wdr\n"
	"	ldi r24, " TEXT(CHANGE) "\n"
	"	ldi r25, " TEXT(INTERRUPT) "\n"
	"	sts 0x60, r24\n" /* WDTCSR */
	"	sts 0x60, r25\n"
	"	.popsection\n");

ISR(WDT_vect)
{
	kept.address = (uint16_t)(uintptr_t)__builtin_return_address(0);
	kept.hung = true;
	wdt_enable(WDTO_15MS);
	for (;;)
		;
}
