/* SPDX-License-Identifier: MIT */
#include "ranger.h"
#include "board.h"         /* twi_* */
#include "configuration.h" /* schedule, enabled rangers */
#include "link.h"          /* sending the messages */
#include "parts.h"         /* what was found */
#include "status.h"        /* error counters */

/* [Devantech, SRF02 technical specification] An SRF02 does not answer while it is ranging: at most 65 ms, in practice about 61 ms. */
#define COMMAND_RANGE_US 0x52u
#define REGISTER_COMMAND 0u
#define REGISTER_REVISION 0u
#define REVISION_BUSY 0xFFu /* some SRF02 answer this while ranging, instead of not answering */
#define RANGING_MIN_TICKS (60u * TICKS_PER_MS) /* first request for the result */
#define RANGING_MAX_TICKS (72u * TICKS_PER_MS) /* last request: 65 ms with a margin */
#define POLL_TICKS (TICKS_PER_MS / 2u)         /* between requests */

#define TRIGGER_TRIES 3u
#define RETRY_TICKS TICKS_PER_MS          /* between tries */
#define QUIET_TICKS TICKS_PER_MS          /* before a trigger the bus is kept free: longer than any other transfer */
#define START_TICKS (100u * TICKS_PER_MS) /* longer than a ranging cycle that began before a reset */
#define IDLE_TICKS (30u * TICKS_PER_MS)   /* until the next call of a ranger with a transfer under way, or with nothing to do */

/* Half periods of the two schedules: see ranger.h. */
#define CONCURRENT_HALF_TICKS (33u * TICKS_PER_MS)
#define SEQUENTIAL_HALF_TICKS (70u * TICKS_PER_MS)

#define CONCURRENT_JITTER_MASK 0x1FFFu /* ticks: up to 4.1 ms */
#define JITTER_STEPS 13u               /* bits of the mask: every bit of a delay is new */
#define LFSR_TAPS 0xB400u              /* 16-bit Galois register of maximal length */
#define LFSR_START 0xACE1u             /* any value but 0 */

enum stage { WAITING, TRIGGERING, RANGING, READING };

static struct ranger {
	struct twi_transfer transfer;
	enum stage stage;
	uint8_t index; /* RANGER_LEFT, RANGER_RIGHT */
	uint8_t tries;
	uint32_t slot;    /* grid time of this ping, without the delay */
	uint32_t due;     /* time of the trigger, or of the next request for the result */
	uint32_t trigger; /* time of the trigger */
} rangers[2];

static const struct {
	uint8_t address, sensor;
	enum device device;
} devices[2] = {
	[RANGER_LEFT] = { 0x70, SENSORS_RANGER_LEFT, DEVICE_RANGER_LEFT },
	[RANGER_RIGHT] = { 0x71, SENSORS_RANGER_RIGHT, DEVICE_RANGER_RIGHT },
};

static uint16_t lfsr;

static uint32_t half_period(void)
{
	return configuration.schedule == SCHEDULE_SEQUENTIAL ? SEQUENTIAL_HALF_TICKS : CONCURRENT_HALF_TICKS;
}

/* Pseudo-random delay in ticks, 0 when sequential; the same sequence after every start. With one shift per delay, each delay would be
 * about half of the previous one. */
static uint16_t jitter(void)
{
	if (configuration.schedule == SCHEDULE_SEQUENTIAL)
		return 0;
	for (uint8_t n = 0; n < JITTER_STEPS; n++)
		lfsr = (uint16_t)((lfsr >> 1) ^ ((lfsr & 1u) ? LFSR_TAPS : 0u));
	return lfsr & CONCURRENT_JITTER_MASK;
}

static bool blocked_by_other(const struct ranger *r)
{
	return configuration.schedule == SCHEDULE_SEQUENTIAL && rangers[!r->index].stage != WAITING;
}

static bool may_trigger(const struct ranger *r)
{
	return r->stage == WAITING && configuration_reads(devices[r->index].sensor) && !blocked_by_other(r);
}

/* Goes to the next slot. A ranger that is late by less than half a period triggers late; one that is later skips slots. The grid does
 * not move. */
static void schedule_next(struct ranger *r, uint32_t now)
{
	do
		r->slot += 2u * half_period();
	while (ticks_reached(now, r->slot + half_period()));
	r->due = r->slot + jitter();
	r->tries = 0;
	r->stage = WAITING;
}

static void report(const struct ranger *r, uint8_t outcome, uint16_t time_of_flight_us)
{
	struct msg_ping ping = { r->trigger, r->index, outcome, time_of_flight_us };
	link_send(MSG_PING, msg_pack_ping(link_body(), &ping));
}

static void fail(struct ranger *r, uint32_t now, uint8_t fault)
{
	status_failed(devices[r->index].device, fault);
	report(r, OUTCOME_BUS_ERROR, 0);
	schedule_next(r, now);
}

static void succeed(struct ranger *r, uint32_t now)
{
	uint16_t time_of_flight_us = (uint16_t)((uint16_t)(r->transfer.bytes[2] << 8) | r->transfer.bytes[3]);
	status_ok(devices[r->index].device);
	parts_found(devices[r->index].device, PART_SRF02, r->transfer.bytes[0]);
	report(r, time_of_flight_us ? OUTCOME_ECHO : OUTCOME_NO_ECHO, time_of_flight_us);
	schedule_next(r, now);
}

static void begin(struct ranger *r, enum stage stage)
{
	if (twi_begin(&r->transfer))
		r->stage = stage;
}

static void trigger(struct ranger *r, uint32_t now)
{
	r->transfer.write_length = 2;
	r->transfer.read_length = 0;
	r->transfer.bytes[0] = REGISTER_COMMAND;
	r->transfer.bytes[1] = COMMAND_RANGE_US;
	r->trigger = now;
	begin(r, TRIGGERING);
}

static void check_trigger(struct ranger *r, uint32_t now)
{
	enum twi_state state = twi_state(&r->transfer);
	if (state == TWI_DONE) {
		r->trigger = r->transfer.ticks;
		r->due = r->trigger + RANGING_MIN_TICKS;
		r->stage = RANGING;
	} else if (state == TWI_NACK && ++r->tries < TRIGGER_TRIES) {
		r->due = now + RETRY_TICKS;
		r->stage = WAITING;
	} else if (state != TWI_BUSY) {
		fail(r, now, state == TWI_NACK ? FAULT_NO_ANSWER : FAULT_BUS_STUCK);
	}
}

/* Reads revision and result in one transfer: a revision of REVISION_BUSY means that the ranging is not over. */
static void request_result(struct ranger *r)
{
	r->transfer.write_length = 1;
	r->transfer.read_length = 4;
	r->transfer.bytes[0] = REGISTER_REVISION;
	begin(r, READING);
}

static void check_result(struct ranger *r, uint32_t now)
{
	enum twi_state state = twi_state(&r->transfer);
	if (state == TWI_BUSY)
		return;
	if (state == TWI_DONE && r->transfer.bytes[0] != REVISION_BUSY) {
		succeed(r, now);
	} else if (ticks_reached(now, r->trigger + RANGING_MAX_TICKS)) {
		fail(r, now, state == TWI_FAILED ? FAULT_BUS_STUCK : FAULT_TOO_LATE);
	} else {
		r->due = now + POLL_TICKS;
		r->stage = RANGING;
	}
}

static void advance(struct ranger *r, uint32_t now)
{
	if (r->stage == TRIGGERING)
		check_trigger(r, now);
	else if (r->stage == READING)
		check_result(r, now);
	if (!ticks_reached(now, r->due))
		return;
	if (may_trigger(r))
		trigger(r, now);
	else if (r->stage == RANGING && ranger_quiet(now))
		request_result(r);
}

/* Time of the next call. The end of a transfer needs none: its interrupt ends the sleep. */
static uint32_t wake_time(const struct ranger *r, uint32_t now)
{
	bool timed = r->stage == RANGING || may_trigger(r);
	if (!timed)
		return now + IDLE_TICKS;
	return ticks_reached(now, r->due) ? now + POLL_TICKS : r->due;
}

static void start_one(uint8_t index, uint32_t slot)
{
	struct ranger *r = &rangers[index];
	r->index = index;
	r->transfer.address = devices[index].address;
	r->slot = slot;
	if (r->stage == WAITING)
		r->due = slot + jitter();
}

void ranger_start(uint32_t now)
{
	lfsr = LFSR_START;
	start_one(RANGER_LEFT, now + START_TICKS);
	start_one(RANGER_RIGHT, now + START_TICKS + half_period());
}

uint32_t ranger_run(uint32_t now)
{
	advance(&rangers[RANGER_LEFT], now);
	advance(&rangers[RANGER_RIGHT], now);
	uint32_t left = wake_time(&rangers[RANGER_LEFT], now), right = wake_time(&rangers[RANGER_RIGHT], now);
	return ticks_reached(left, right) ? right : left;
}

bool ranger_quiet(uint32_t now)
{
	for (uint8_t i = 0; i < 2; i++)
		if (may_trigger(&rangers[i]) && ticks_reached(now + QUIET_TICKS, rangers[i].due))
			return false;
	return true;
}
