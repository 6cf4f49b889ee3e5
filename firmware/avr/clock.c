/* SPDX-License-Identifier: MIT */
/* The 32-bit clock: Timer1 at 2 MHz extended by an overflow count; SyncOut edges on its input capture (PD4); and the alarm that ends a
 * sleep. */
#include <avr/interrupt.h> /* ISR */
#include <avr/io.h>        /* registers */
#include <util/atomic.h>   /* ATOMIC_BLOCK */
#include "shared.h"

#define SYNC_PULSES_TICKS (50u * TICKS_PER_MS) /* an MTx pulses at least every 20 ms */

static volatile uint16_t overflows;
static struct clock_edge edge; /* shared with the capture interrupt: read with interrupts off */
static bool edge_waiting;      /* as above */

void clock_start(void)
{
	TCCR1A = 0;
	TCCR1B = BIT(ICNC1) | BIT(ICES1) | BIT(CS11); /* noise canceller, rising edge, 16 MHz / 8 */
	TIMSK1 = BIT(ICIE1) | BIT(OCIE1A) | BIT(TOIE1);
}

/* Extends a timer value to 32 bits; call with interrupts off. An overflow that is flagged but not counted yet has happened before a small
 * timer value, and after a large one. */
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

bool clock_sync_pulses(void)
{
	bool pulses;
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		pulses = edge.edge && !ticks_reached(extend(TCNT1), edge.ticks + SYNC_PULSES_TICKS);
	}
	return pulses;
}

void clock_alarm(uint32_t ticks)
{
	OCR1A = (uint16_t)ticks;
}

bool clock_take_edge(struct clock_edge *out)
{
	bool waiting;
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		waiting = edge_waiting;
		*out = edge;
		edge.missed = 0;
		edge_waiting = false;
	}
	return waiting;
}

ISR(TIMER1_OVF_vect)
{
	overflows++;
}

ISR(TIMER1_COMPA_vect)
{
	board_awake = true;
}

ISR(TIMER1_CAPT_vect)
{
	if (echo_capture_left(ICR1))
		return;
	edge.ticks = extend(ICR1);
	edge.edge++;
	if (edge_waiting)
		edge.missed++;
	edge_waiting = true;
	board_awake = true;
}
