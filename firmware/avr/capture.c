/* SPDX-License-Identifier: MIT */
/* The two input captures, each with its line: PD4 (Timer1), which is SyncOut or the data-ready line of a foot board, or
 * the left echo line; and PC7 (Timer3, at the same rate), the right echo line. A ping owns its line from the trigger to
 * the end of the pulse, else the line's edges are SyncOut's. Triggers are on PF5 (left) and PF4 (right). A capture has
 * no jitter but the timers' half microsecond, however late its interrupt is. */
#include <avr/interrupt.h> /* ISR */
#include <avr/io.h>        /* registers */
#include <avr/power.h>     /* switching on Timer3 */
#include <util/atomic.h>   /* ATOMIC_BLOCK */
#include <util/delay.h>    /* length of the trigger pulse */
#include "shared.h"

#define LEFT 0u
#define RIGHT 1u
#define TRIGGER_US 60 /* at least 10 [HC-SR04 user guide], 50 [RCWL-1655] */
#define RISE_US 12
#define PULL_US 200
#define TRIGGER_LEFT BIT(PF5)
#define TRIGGER_RIGHT BIT(PF4)
#define LINE_LEFT BIT(PD4)
#define LINE_RIGHT BIT(PC7)
#define RISING_1 (BIT(ICNC1) | BIT(ICES1) | BIT(CS11)) /* noise canceller; 16 MHz / 8 */
#define FALLING_1 (BIT(ICNC1) | BIT(CS11))
#define RISING_3 (BIT(ICNC3) | BIT(ICES3) | BIT(CS31))
#define FALLING_3 (BIT(ICNC3) | BIT(CS31))
#define SYNC_PULSES_TICKS (50u * TICKS_PER_MS) /* an MTx pulses at least every 20 ms */

/* Shared with the capture interrupts: read with interrupts off. */
static struct capture_edge edge;
static bool edge_waiting;
static volatile bool sync_pulses; /* an edge came in the last SYNC_PULSES_TICKS */
static struct capture_pulse pulses[2];
static volatile enum capture_state states[2] = { CAPTURE_OVER, CAPTURE_OVER }; /* over: no ping owns the line */

static bool timer_3_runs;
static uint16_t timer_3_behind; /* Timer1 less Timer3 */

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

/* The bootloader leaves PC7, the pin of its LED, as an output. Lines that nothing drives are pulled up, so that they do
 * not follow the mains. */
void capture_start(void)
{
	DDRC &= (uint8_t)~LINE_RIGHT;
	PORTC |= LINE_RIGHT;
	PORTD |= LINE_LEFT;
	await_edge(LEFT, true);
	TIMSK1 |= BIT(ICIE1);
}

/* At the first trigger: with SRF02 the trigger pins stay inputs, and Timer3 stays off. */
static void start_timer_3(void)
{
	power_timer3_enable();
	DDRF |= TRIGGER_LEFT | TRIGGER_RIGHT;
	TCCR3A = 0;
	TCCR3B = RISING_3;
	/* an interrupt between the two readings would shift all stamps of the right ranger */
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		timer_3_behind = (uint16_t)(TCNT1 - TCNT3);
	}
	timer_3_runs = true;
}

static bool line_is_taken(uint8_t side)
{
	return side == LEFT ? (PIND & LINE_LEFT) || sync_pulses : PINC & LINE_RIGHT;
}

bool capture_trigger(uint8_t side)
{
	uint8_t trigger = side == LEFT ? TRIGGER_LEFT : TRIGGER_RIGHT;
	if (line_is_taken(side))
		return false;
	if (!timer_3_runs)
		start_timer_3();
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		states[side] = CAPTURE_WAITING;
		await_edge(side, true);
		if (side == RIGHT)
			TIMSK3 = BIT(ICIE3);
	}
	PORTF |= trigger;
	_delay_us(TRIGGER_US);
	PORTF &= (uint8_t)~trigger;
	return true;
}

/* Never drives high: the pull-up goes off before, and on after it. The edges that it makes are nobody's. */
bool capture_pull_low(uint8_t side)
{
	volatile uint8_t *port = side == LEFT ? &PORTD : &PORTC, *direction = side == LEFT ? &DDRD : &DDRC;
	uint8_t line = side == LEFT ? LINE_LEFT : LINE_RIGHT;
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		TIMSK1 &= (uint8_t)~BIT(ICIE1);
	}
	*port &= (uint8_t)~line;
	*direction |= line;
	_delay_us(PULL_US);
	*direction &= (uint8_t)~line;
	*port |= line;
	_delay_us(RISE_US);
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		TIFR1 = side == LEFT ? BIT(ICF1) : 0;
		TIMSK1 |= BIT(ICIE1);
	}
	return !line_is_taken(side);
}

enum capture_state capture_take_pulse(uint8_t side, struct capture_pulse *out)
{
	enum capture_state state;
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		state = states[side];
		*out = pulses[side];
	}
	return state;
}

void capture_end_pulse(uint8_t side)
{
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		states[side] = CAPTURE_OVER;
		await_edge(side, true);
		if (side == RIGHT)
			TIMSK3 = 0;
	}
}

/* The main loop calls this every few ms, so that an edge is forgotten long before its ticks look recent again. */
bool capture_take_edge(struct capture_edge *out)
{
	bool waiting;
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		if (ticks_reached(clock_now(), edge.ticks + SYNC_PULSES_TICKS))
			sync_pulses = false;
		waiting = edge_waiting;
		*out = edge;
		edge.missed = 0;
		edge_waiting = false;
	}
	return waiting;
}

/* An edge on a line that a ping owns; called by the interrupts. */
static void take_ping_edge(uint8_t side, uint16_t timer)
{
	bool rises = states[side] == CAPTURE_WAITING;
	await_edge(side, !rises);
	if (rises) {
		pulses[side].rise = clock_at(timer);
		states[side] = CAPTURE_HIGH;
	} else {
		pulses[side].fall = clock_at(timer);
		states[side] = CAPTURE_OVER;
		board_awake = true;
	}
}

ISR(TIMER1_CAPT_vect)
{
	if (states[LEFT] != CAPTURE_OVER) {
		take_ping_edge(LEFT, ICR1);
		return;
	}
	edge.ticks = clock_at(ICR1);
	edge.edge++;
	if (edge_waiting)
		edge.missed++;
	edge_waiting = sync_pulses = true;
	board_awake = true;
}

ISR(TIMER3_CAPT_vect)
{
	if (states[RIGHT] != CAPTURE_OVER)
		take_ping_edge(RIGHT, (uint16_t)(ICR3 + timer_3_behind));
}
