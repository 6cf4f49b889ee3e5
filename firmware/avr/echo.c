/* SPDX-License-Identifier: MIT */
/* Pulse rangers: triggers on PF5 (left) and PF4 (right); echo lines on PD4, the capture input of Timer1, and on PC7, that of Timer3, which
 * runs at the same rate. A capture has no jitter but the timers' half microsecond, however late its interrupt is. */
#include <avr/interrupt.h> /* ISR */
#include <avr/io.h>        /* registers */
#include <avr/power.h>     /* switching on Timer3 */
#include <util/atomic.h>   /* ATOMIC_BLOCK */
#include <util/delay.h>    /* length of the trigger pulse */
#include "shared.h"

#define LEFT 0u
#define RIGHT 1u
#define TRIGGER_US 12 /* at least 10 [HC-SR04 user guide] */
#define TRIGGER_LEFT BIT(PF5)
#define TRIGGER_RIGHT BIT(PF4)
#define ECHO_LEFT BIT(PD4)
#define ECHO_RIGHT BIT(PC7)
#define RISING_1 (BIT(ICNC1) | BIT(ICES1) | BIT(CS11))
#define FALLING_1 (BIT(ICNC1) | BIT(CS11))
#define RISING_3 (BIT(ICNC3) | BIT(ICES3) | BIT(CS31))
#define FALLING_3 (BIT(ICNC3) | BIT(CS31))

static struct echo_pulse pulses[2]; /* shared with the capture interrupts: read with interrupts off */
static volatile enum echo_state states[2] = { ECHO_OVER, ECHO_OVER };
static bool started;
static uint16_t timer_3_behind; /* Timer1 less Timer3 */

/* At the first trigger: with SRF02 the pins stay inputs, and Timer3 stays off. */
static void start(void)
{
	power_timer3_enable();
	DDRF |= TRIGGER_LEFT | TRIGGER_RIGHT;
	TCCR3A = 0;
	TCCR3B = RISING_3;
	timer_3_behind = (uint16_t)(TCNT1 - TCNT3);
	started = true;
}

/* A change of the edge may set the capture's flag: it is cleared. */
static void await_edge(uint8_t side, bool rising)
{
	if (side == LEFT) {
		TCCR1B = rising ? RISING_1 : FALLING_1;
		TIFR1 = BIT(ICF1);
	} else {
		TCCR3B = rising ? RISING_3 : FALLING_3;
		TIFR3 = BIT(ICF3);
	}
}

static bool line_is_taken(uint8_t side)
{
	return side == LEFT ? (PIND & ECHO_LEFT) || clock_sync_pulses() : PINC & ECHO_RIGHT;
}

bool echo_begin(uint8_t side)
{
	uint8_t trigger = side == LEFT ? TRIGGER_LEFT : TRIGGER_RIGHT;
	if (line_is_taken(side))
		return false;
	if (!started)
		start();
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		states[side] = ECHO_WAITING;
		await_edge(side, true);
		if (side == RIGHT)
			TIMSK3 = BIT(ICIE3);
	}
	PORTF |= trigger;
	_delay_us(TRIGGER_US);
	PORTF &= (uint8_t)~trigger;
	return true;
}

enum echo_state echo_take(uint8_t side, struct echo_pulse *out)
{
	enum echo_state state;
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		state = states[side];
		*out = pulses[side];
	}
	return state;
}

void echo_end(uint8_t side)
{
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		states[side] = ECHO_OVER;
		await_edge(side, true);
		if (side == RIGHT)
			TIMSK3 = 0;
	}
}

/* An edge on a line that is awaited; called by the interrupts. */
static void capture(uint8_t side, uint16_t timer)
{
	bool rises = states[side] == ECHO_WAITING;
	await_edge(side, !rises);
	if (rises) {
		pulses[side].rise = clock_at(timer);
		states[side] = ECHO_HIGH;
	} else {
		pulses[side].fall = clock_at(timer);
		states[side] = ECHO_OVER;
		board_awake = true;
	}
}

bool echo_capture_left(uint16_t timer)
{
	bool awaited = states[LEFT] != ECHO_OVER;
	if (awaited)
		capture(LEFT, timer);
	return awaited;
}

ISR(TIMER3_CAPT_vect)
{
	if (states[RIGHT] != ECHO_OVER)
		capture(RIGHT, (uint16_t)(ICR3 + timer_3_behind));
}
