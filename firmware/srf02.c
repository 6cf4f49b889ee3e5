/* SPDX-License-Identifier: MIT */
#include "srf02.h"
#include "board.h" /* twi_* */
#include "bus.h"   /* it is kept free for triggers */
#include "parts.h" /* what was found */

/* [Devantech, SRF02 technical specification] An SRF02 does not answer while it is ranging: up to 65 ms, in practice
 * about 61 ms; it listens longer than to its farthest range. */
#define ADDRESS_LEFT 0x70u
#define COMMAND_RANGE_US 0x52u
#define REGISTER_COMMAND 0u
#define REGISTER_REVISION 0u
#define UNUSED 0x80u /* content of register 1 [SRF02 technical specification] */
#define REVISION_BUSY 0xFFu /* some SRF02 answer this while ranging, instead of not answering */
#define RANGING_MIN_TICKS (60u * TICKS_PER_MS) /* first request for the result */
/* last request: up to 65 ms, and 70 "is a better value" [Devantech's forum, t=269], with a margin */
#define RANGING_MAX_TICKS (90u * TICKS_PER_MS)
#define FARTHEST_US 35500u /* 600 cm [technical specification]: what comes later is another ping's */
#define POLL_TICKS (TICKS_PER_MS / 2u)         /* between requests */

enum stage { TRIGGERING, RANGING, READING };

bool srf02_begin(uint8_t side, struct ranging *r)
{
	r->transfer.address = (uint8_t)(ADDRESS_LEFT + side);
	r->transfer.write_length = 2;
	r->transfer.read_length = 0;
	r->transfer.bytes[0] = REGISTER_COMMAND;
	r->transfer.bytes[1] = COMMAND_RANGE_US;
	r->stage = TRIGGERING;
	return twi_begin(&r->transfer);
}

static enum ranging_state check_trigger(struct ranging *r)
{
	enum twi_state state = twi_state(&r->transfer);
	if (state == TWI_NACK)
		return RANGING_REFUSED;
	if (state == TWI_FAILED) {
		r->fault = FAULT_BUS_STUCK;
		return RANGING_FAILED;
	}
	if (state == TWI_DONE) {
		r->trigger = r->transfer.ticks;
		r->due = r->trigger + RANGING_MIN_TICKS;
		r->stage = RANGING;
	}
	return RANGING_BUSY;
}

/* Reads revision and result in one transfer: a revision of REVISION_BUSY means that the ranging is not over. */
static void request_result(struct ranging *r)
{
	r->transfer.write_length = 1;
	r->transfer.read_length = 4;
	r->transfer.bytes[0] = REGISTER_REVISION;
	if (twi_begin(&r->transfer))
		r->stage = READING;
}

static enum ranging_state finish(uint8_t side, struct ranging *r)
{
	if (r->transfer.bytes[1] != UNUSED)
		return RANGING_REFUSED;
	uint16_t us = (uint16_t)((uint16_t)r->transfer.bytes[2] << 8 | r->transfer.bytes[3]);
	r->time_of_flight_us = us > FARTHEST_US ? 0 : us;
	parts_found(side, PART_SRF02, r->transfer.bytes[0]);
	return RANGING_DONE;
}

static enum ranging_state check_result(uint8_t side, uint32_t now, struct ranging *r)
{
	enum twi_state state = twi_state(&r->transfer);
	if (state == TWI_BUSY)
		return RANGING_BUSY;
	if (state == TWI_DONE && r->transfer.bytes[0] != REVISION_BUSY)
		return finish(side, r);
	if (ticks_reached(now, r->trigger + RANGING_MAX_TICKS)) {
		r->fault = state == TWI_FAILED ? FAULT_BUS_STUCK : FAULT_TOO_LATE;
		return RANGING_FAILED;
	}
	r->due = now + POLL_TICKS;
	r->stage = RANGING;
	return RANGING_BUSY;
}

enum ranging_state srf02_run(uint8_t side, uint32_t now, struct ranging *r)
{
	enum ranging_state state = RANGING_BUSY;
	if (r->stage == TRIGGERING)
		state = check_trigger(r);
	else if (r->stage == READING)
		state = check_result(side, now, r);
	if (r->stage == RANGING && ticks_reached(now, r->due) && bus_is_quiet(now))
		request_result(r);
	r->next = r->stage != RANGING ? now + RANGER_IDLE_TICKS : ticks_reached(now, r->due) ? now + POLL_TICKS : r->due;
	return state;
}
