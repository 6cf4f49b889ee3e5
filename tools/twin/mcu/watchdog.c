/* SPDX-License-Identifier: GPL-3.0-or-later
 * Watchdog with interrupt and reset [ATmega32U4 data sheet, chapter 8]. simavr's own raises its interrupt for ever when
 * interrupts are off, and does not follow a new period. */
#include <simavr/avr_watchdog.h>
#include <simavr/sim_cycle_timers.h>
#include <simavr/sim_interrupts.h>

#include "twin.h"

enum { WDTCSR = 0x60, WDIF = 0x80, WDIE = 0x40, WDP3 = 0x20, WDCE = 0x10, WDE = 8, PERIOD = 7 };
#define VECTOR 12
#define CHANGE_CYCLES 4

static avr_cycle_count_t change_until;
static avr_run_t plain_run;

static avr_cycle_count_t period(void)
{
	uint8_t control = avr->data[WDTCSR];

	return US(16000) << ((control & PERIOD) | (control & WDP3 ? 8 : 0));
}

static void reset_processor(avr_t *a)
{
	a->run = plain_run;
	board_reset(WATCHDOG);
}

/* The interrupt comes first; without it, or when it was not served for a whole period, the reset. */
static avr_cycle_count_t expired(avr_t *a, avr_cycle_count_t when, void *param)
{
	uint8_t control = a->data[WDTCSR];

	if ((control & WDIE) && !vector(VECTOR)->pending) {
		avr_raise_interrupt(a, vector(VECTOR));
		return when + period();
	}
	if (control & WDE) {
		plain_run = a->run;
		a->run = reset_processor;
	}
	return 0;
}

static void restart(void)
{
	avr_cycle_timer_cancel(avr, expired, NULL);
	if (avr->data[WDTCSR] & (WDE | WDIE))
		avr_cycle_timer_register(avr, period(), expired, NULL);
}

/* A new period, or the end of WDE, needs a write of WDCE and WDE within the four cycles before. */
static void write_control(avr_t *a, avr_io_addr_t address, uint8_t value, void *param)
{
	uint8_t old = a->data[address];

	if ((value & (WDCE | WDE)) == (WDCE | WDE)) {
		change_until = a->cycle + CHANGE_CYCLES;
		a->data[address] = old | WDE;
		return;
	}
	if (a->cycle <= change_until)
		a->data[address] = value & (uint8_t)~(WDIF | WDCE);
	else
		a->data[address] = (uint8_t)((old & (uint8_t)~WDIE) | (value & (WDIE | WDE)));
	restart();
}

/* Serving the interrupt leaves only the reset. */
static void served(struct avr_irq_t *irq, uint32_t running, void *param)
{
	if (running)
		avr->data[WDTCSR] &= (uint8_t)~(WDIE | WDIF);
}

static int on_ioctl(avr_io_t *port, uint32_t control, void *param)
{
	if (control != AVR_IOCTL_WATCHDOG_RESET)
		return -1;
	restart();
	return 0;
}

void watchdog_init(void)
{
	static avr_io_t io = { .kind = "watchdog of the twin", .ioctl = on_ioctl };

	avr_register_io(avr, &io); /* comes before simavr's own, which then sees no instruction WDR */
	take_register(WDTCSR, NULL, write_control);
	avr_irq_register_notify(vector(VECTOR)->irq + AVR_INT_IRQ_RUNNING, served, NULL);
}
