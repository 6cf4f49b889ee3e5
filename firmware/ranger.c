/* SPDX-License-Identifier: MIT */
#include "ranger.h"
#include "board.h"         /* ticks */
#include "bus.h"           /* plan of the triggers */
#include "configuration.h" /* schedule, enabled rangers */
#include "link.h"          /* sending the messages */
#include "maxsonar.h"      /* driver */
#include "parts.h"         /* refused wiring */
#include "pulse.h"         /* driver */
#include "srf02.h"         /* driver */
#include "status.h"        /* error counters */

#define TRIGGER_TRIES 3u
#define RETRY_TICKS TICKS_PER_MS          /* between tries */
#define POLL_TICKS (TICKS_PER_MS / 2u)    /* between tries to get the bus */
#define START_TICKS (100u * TICKS_PER_MS) /* longer than a ranging cycle that began before a reset */
/* between looks at an echo line that is high; longer than a trigger keeps the bus free before it */
#define HOLD_TICKS (5u * TICKS_PER_MS / 2u)
/* 0.3 s: some modules hold their line for up to 0.25 s where there is no echo */
#define HOLDS_MAX 120u
/* slots without an answer, half a second, after which any kind is sought again */
#define MISSES_MAX 8u

/* Half periods of the two schedules: see ranger.h. Of a MaxSonar a new ranging is advised every 100 ms [MaxBotix
 * PD11848]. */
#define CONCURRENT_HALF_TICKS (33u * TICKS_PER_MS)
#define SEQUENTIAL_HALF_TICKS (70u * TICKS_PER_MS)
#define SLOW_CONCURRENT_HALF_TICKS (50u * TICKS_PER_MS)
#define CYCLE_MARGIN_TICKS (2u * TICKS_PER_MS) /* of the period over the measured cycle: half of the jitter */
#define SLOW_SEQUENTIAL_HALF_TICKS (100u * TICKS_PER_MS)

#define CONCURRENT_JITTER_MASK 0x1FFFu /* ticks: up to 4.1 ms */
#define JITTER_STEPS 13u               /* bits of the mask: every bit of a delay is new */
#define LFSR_TAPS 0xB400u              /* 16-bit Galois register of maximal length */
#define LFSR_START 0xACE1u             /* any value but 0 */

enum kind { UNKNOWN, MAXSONAR, SRF02, PULSE }; /* in the order in which they are sought, and preferred */

static struct ranger {
	bool pinging;
	uint8_t index;     /* RANGER_LEFT, RANGER_RIGHT */
	enum kind kind;    /* that answers */
	enum kind pinged;  /* that was triggered in this slot */
	uint8_t tries;     /* of the trigger in this slot */
	uint8_t misses;    /* slots in a row without an answer */
	uint8_t holds;     /* looks in a row at an echo line that is high */
	uint32_t slot;     /* grid time of this ping, without the delay */
	uint32_t due;      /* time of the trigger */
	struct ranging ranging;
} rangers[2];

static uint16_t lfsr;
static bool slow; /* the grid is that of a MaxSonar */
static uint32_t cycle; /* ticks: of the last rangings of SRF02, nearer to the longer ones */

static uint32_t half_period(void)
{
	if (configuration.schedule == SCHEDULE_SEQUENTIAL)
		return slow ? SLOW_SEQUENTIAL_HALF_TICKS : SEQUENTIAL_HALF_TICKS;
	uint32_t half = slow ? SLOW_CONCURRENT_HALF_TICKS : CONCURRENT_HALF_TICKS;
	uint32_t measured = (cycle + CYCLE_MARGIN_TICKS) / 2u;
	return measured > half ? measured : half;
}

/* The grid follows the slower ranger: a quarter of the way when its cycle is longer, a sixteenth when it is shorter. */
static void follow_cycle(const struct ranger *r, uint32_t now)
{
	uint32_t measured = now - r->ranging.trigger;
	if (r->kind != SRF02)
		cycle = 0;
	else
		cycle = measured > cycle ? cycle + (measured - cycle) / 4u : cycle - (cycle - measured) / 16u;
}

/* From a slot of the left ranger to the next one of the right ranger. */
static uint32_t apart(void)
{
	return configuration.schedule == SCHEDULE_SIMULTANEOUS ? 0 : half_period();
}

/* Pseudo-random delay in ticks, 0 unless concurrent; the same sequence after every start. With one shift per delay,
 * each delay would be about half of the previous one. */
static uint16_t jitter(void)
{
	if (configuration.schedule != SCHEDULE_CONCURRENT)
		return 0;
	for (uint8_t n = 0; n < JITTER_STEPS; n++)
		lfsr = (uint16_t)((lfsr >> 1) ^ ((lfsr & 1u) ? LFSR_TAPS : 0u));
	return lfsr & CONCURRENT_JITTER_MASK;
}

static bool blocked_by_other(const struct ranger *r)
{
	return configuration.schedule == SCHEDULE_SEQUENTIAL && rangers[!r->index].pinging;
}

static bool may_trigger(const struct ranger *r)
{
	return !r->pinging && configuration_reads((uint8_t)(SENSORS_RANGER_LEFT << r->index)) && !blocked_by_other(r);
}

static enum kind first_kind(const struct ranger *r)
{
	return r->kind == UNKNOWN ? MAXSONAR : r->kind;
}

/* Moves the right ranger's slot to its place between two of the left one's, which keep no such distance when the period
 * changes. */
static void keep_apart(struct ranger *r)
{
	int32_t half = (int32_t)half_period(), off = (int32_t)(r->slot - rangers[RANGER_LEFT].slot - apart()) % (2 * half);
	if (off < -half)
		off += 2 * half;
	if (off > half)
		off -= 2 * half;
	if (r->index == RANGER_RIGHT && configuration_reads(SENSORS_RANGER_LEFT))
		r->slot -= (uint32_t)off;
}

/* Goes to the next slot. A ranger that is late by less than half a period triggers late; one that is later skips
 * slots. */
static void schedule_next(struct ranger *r, uint32_t now)
{
	do
		r->slot += 2u * half_period();
	while (ticks_reached(now, r->slot + half_period()));
	keep_apart(r);
	r->due = r->slot + jitter();
	r->tries = 0;
	r->pinging = false;
	r->pinged = first_kind(r);
	r->ranging.fault = FAULT_NO_ANSWER;
}

static void report(const struct ranger *r, uint8_t outcome, uint16_t time_of_flight_us)
{
	struct msg_ping ping = { r->ranging.trigger, r->index, outcome, time_of_flight_us };
	link_send(MSG_PING, msg_pack_ping(link_body(), &ping));
}

/* FAULT_NONE: an answer, but not yet enough to know the kind. */
static void fail(struct ranger *r, uint32_t now, uint8_t fault)
{
	if (fault != FAULT_NONE) {
		status_failed((enum device)r->index, fault);
		report(r, OUTCOME_BUS_ERROR, 0);
	}
	schedule_next(r, now);
}

static void succeed(struct ranger *r, uint32_t now)
{
	struct ranger *other = &rangers[!r->index];
	if (other->kind != UNKNOWN && other->kind < r->pinged) {
		parts_set_wiring(WIRING_MIXED_RANGERS);
		fail(r, now, FAULT_NO_ANSWER);
		return;
	}
	uint16_t time_of_flight_us = r->ranging.time_of_flight_us;
	r->kind = r->pinged;
	r->misses = r->holds = 0;
	follow_cycle(r, now);
	if (other->kind > r->kind)
		other->kind = UNKNOWN; /* its next answer is refused */
	if (other->kind == r->kind)
		parts_set_wiring(WIRING_OK);
	status_ok((enum device)r->index);
	report(r, time_of_flight_us ? OUTCOME_ECHO : OUTCOME_NO_ECHO, time_of_flight_us);
	schedule_next(r, now);
}

static void miss(struct ranger *r, uint32_t now, uint8_t fault)
{
	if (r->kind != UNKNOWN && ++r->misses >= MISSES_MAX) {
		r->kind = UNKNOWN;
		r->misses = 0;
	}
	fail(r, now, fault);
}

/* The ranger has not accepted its trigger: another try, or another kind if it is not known, then the next slot. */
static void try_again(struct ranger *r, uint32_t now)
{
	bool sought = r->kind == UNKNOWN;
	bool once = r->pinged == PULSE || (r->pinged == MAXSONAR && sought);
	r->pinging = false;
	r->due = now + RETRY_TICKS;
	if (!once && ++r->tries < TRIGGER_TRIES)
		return;
	if (sought && r->pinged != PULSE) {
		r->pinged++;
		return;
	}
	miss(r, now, r->ranging.fault);
}

/* On a bus that is stuck nothing can be sought: what is left is a pulse ranger, which needs none. */
static void fail_or_seek_on(struct ranger *r, uint32_t now)
{
	if (r->kind != UNKNOWN || r->pinged == PULSE || r->ranging.fault != FAULT_BUS_STUCK) {
		fail(r, now, r->ranging.fault);
		return;
	}
	r->pinged = PULSE;
	r->pinging = false;
	r->due = now;
}

/* The echo line is high: held by a module that has heard no echo, pulled up because nothing is plugged in, or stuck. A
 * module without a timeout holds it for ever, unless it is pulled low: an answer that does not end shows that one is
 * there. */
static void hold(struct ranger *r, uint32_t now)
{
	bool heard = pulse_was_heard(r->index);
	if (heard && r->holds < HOLDS_MAX) {
		r->holds++;
		r->due = now + HOLD_TICKS;
		return;
	}
	if (heard)
		parts_found(r->index, PART_PULSE, 0);
	bool found = parts_in(r->index) == PART_PULSE;
	if (found && capture_pull_low(r->index)) {
		status_failed((enum device)r->index, FAULT_TOO_LATE);
		r->holds = 0;
		return;
	}
	miss(r, now, found ? FAULT_ALWAYS_READY : r->ranging.fault);
}

static void trigger(struct ranger *r, uint32_t now)
{
	r->ranging.trigger = now;
	r->ranging.next = now;
	if (r->pinged == MAXSONAR)
		r->pinging = maxsonar_begin(r->index, &r->ranging);
	else if (r->pinged == SRF02)
		r->pinging = srf02_begin(r->index, &r->ranging);
	else
		r->pinging = pulse_begin(r->index, &r->ranging);
	if (r->pinging)
		r->holds = 0;
	else if (r->pinged == PULSE)
		hold(r, now);
}

static enum ranging_state run_driver(struct ranger *r, uint32_t now)
{
	if (r->pinged == MAXSONAR)
		return maxsonar_run(r->index, now, &r->ranging);
	return r->pinged == SRF02 ? srf02_run(r->index, now, &r->ranging) : pulse_run(r->index, now, &r->ranging);
}

static void advance(struct ranger *r, uint32_t now)
{
	if (!r->pinging) {
		if (ticks_reached(now, r->due) && may_trigger(r))
			trigger(r, now);
		return;
	}
	switch (run_driver(r, now)) {
	case RANGING_DONE:
		succeed(r, now);
		break;
	case RANGING_FAILED:
		fail_or_seek_on(r, now);
		break;
	case RANGING_REFUSED:
		try_again(r, now);
		break;
	case RANGING_BUSY:
		break;
	}
}

/* Time of the next call. The end of a transfer needs none: its interrupt ends the sleep. */
static uint32_t wake_time(const struct ranger *r, uint32_t now)
{
	if (r->pinging)
		return r->ranging.next;
	if (!may_trigger(r))
		return now + RANGER_IDLE_TICKS;
	return ticks_reached(now, r->due) ? now + POLL_TICKS : r->due;
}

static void start_one(uint8_t index, uint32_t slot)
{
	struct ranger *r = &rangers[index];
	r->index = index;
	r->slot = slot;
	if (!r->pinging) {
		r->due = slot + jitter();
		r->pinged = first_kind(r);
		r->ranging.fault = FAULT_NO_ANSWER;
	}
}

void ranger_start(uint32_t now)
{
	lfsr = LFSR_START;
	start_one(RANGER_LEFT, now + START_TICKS);
	start_one(RANGER_RIGHT, now + START_TICKS + apart());
}

/* Lays the grid anew when the first MaxSonar is found, and when none is left. */
static void fit_grid(uint32_t now)
{
	bool found = rangers[RANGER_LEFT].kind == MAXSONAR || rangers[RANGER_RIGHT].kind == MAXSONAR;
	if (found == slow)
		return;
	slow = found;
	ranger_start(now);
}

uint32_t ranger_cycle(void)
{
	return cycle;
}

static void plan_triggers(void)
{
	for (uint8_t side = 0; side < 2; side++)
		bus_plan_trigger(side, may_trigger(&rangers[side]), rangers[side].due);
}

uint32_t ranger_run(uint32_t now)
{
	advance(&rangers[RANGER_LEFT], now);
	plan_triggers();
	advance(&rangers[RANGER_RIGHT], now);
	fit_grid(now);
	plan_triggers();
	uint32_t left = wake_time(&rangers[RANGER_LEFT], now), right = wake_time(&rangers[RANGER_RIGHT], now);
	return ticks_reached(left, right) ? right : left;
}
