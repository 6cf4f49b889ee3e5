/* SPDX-License-Identifier: MIT */
/* The 32-bit clock: Timer1 at 2 MHz extended by an overflow count; and the alarm that ends a sleep. */
#include <avr/interrupt.h> /* ISR */
#include <avr/io.h>        /* registers */
#include <util/atomic.h>   /* ATOMIC_BLOCK */
#include "shared.h"

#ifndef CLOCK_START
#define CLOCK_START 0ul /* ticks; tests start the clock near its wraps */
#endif

static volatile uint16_t latency; /* longest */
static volatile uint16_t overflows = (uint16_t)(CLOCK_START >> 16);

void clock_start(void)
{
	TCCR1A = 0;
	TCCR1B = BIT(CS11);            /* 16 MHz / 8 */
	TCNT1 = (uint16_t)CLOCK_START; /* the bootloader leaves the timer anywhere */
	TIFR1 = BIT(ICF1) | BIT(OCF1A) | BIT(TOV1); /* the bootloader leaves flags */
	TIMSK1 = BIT(OCIE1A) | BIT(TOIE1);
}

/* Extends a timer value to 32 bits; call with interrupts off. An overflow that is flagged but not counted yet has
 * happened before a small timer value, and after a large one. */
static uint32_t extend(uint16_t low)
{
	uint16_t high = overflows;
	if ((TIFR1 & BIT(TOV1)) && low < 0x8000u)
		high++;
	return (uint32_t)high << 16 | low;
}

uint32_t clock_now(void)
{
	uint32_t now;
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		now = extend(TCNT1);
	}
	return now;
}

uint32_t clock_at(uint16_t timer)
{
	uint32_t now = extend(TCNT1);
	return now - (uint16_t)((uint16_t)now - timer);
}

void clock_alarm(uint32_t ticks)
{
	OCR1A = (uint16_t)ticks;
}

uint16_t clock_take_latency(void)
{
	uint16_t taken;
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		taken = latency;
		latency = 0;
	}
	return taken;
}

/* The timer was at zero when it overflowed. */
ISR(TIMER1_OVF_vect)
{
	uint16_t late = TCNT1;
	if (late > latency)
		latency = late;
	overflows++;
}

ISR(TIMER1_COMPA_vect)
{
	board_awake = true;
}
