/* SPDX-License-Identifier: MIT */
#include "maxsonar.h"
#include "board.h" /* twi_* */
#include "bus.h"   /* it is kept free for triggers */
#include "parts.h" /* what was found */

/* [MaxBotix PD11848, I2CXL-MaxSonar-EZ data sheet] One byte starts a ranging. While it lasts, at least 25 ms,
 * communication is ignored; the result, two bytes in cm, may be read after about 80 ms. Address, command and result are
 * an SRF02's, and there is no identity register. But for an SRF02 the byte is the number of a register, after which it
 * answers at once: a part that answers within 25 ms is not a MaxSonar. */
#define ADDRESS_LEFT 0x70u
#define COMMAND_RANGE 0x51u
#define PROBE_TICKS (5u * TICKS_PER_MS)
#define RESULT_MIN_TICKS (80u * TICKS_PER_MS)
#define RESULT_MAX_TICKS (95u * TICKS_PER_MS) /* by reason: the next ranging may begin after 100 ms */
#define POLL_TICKS (TICKS_PER_MS / 2u)        /* between requests */
#define RANGE_MAX_CM 765u                     /* also where no echo was heard */
#define US_PER_CM 58u                         /* [MaxBotix, formulas for temperature compensation] */

enum stage { TRIGGERING, BEFORE_PROBE, PROBING, BEFORE_READING, READING };

bool maxsonar_begin(uint8_t side, struct ranging *r)
{
	r->transfer.address = (uint8_t)(ADDRESS_LEFT + side);
	r->transfer.write_length = 1;
	r->transfer.read_length = 0;
	r->transfer.bytes[0] = COMMAND_RANGE;
	r->stage = TRIGGERING;
	return twi_begin(&r->transfer);
}

static void wait(struct ranging *r, enum stage stage, uint32_t due)
{
	r->stage = (uint8_t)stage;
	r->due = due;
}

static void request_result(struct ranging *r)
{
	r->transfer.write_length = 0;
	r->transfer.read_length = 2;
	if (twi_begin(&r->transfer))
		r->stage++;
}

static enum ranging_state fail(struct ranging *r, uint8_t fault)
{
	r->fault = fault;
	return RANGING_FAILED;
}

static enum ranging_state finish(uint8_t side, struct ranging *r)
{
	uint16_t range_cm = (uint16_t)((uint16_t)r->transfer.bytes[0] << 8 | r->transfer.bytes[1]);
	if (range_cm > RANGE_MAX_CM)
		return fail(r, FAULT_BAD_VALUE);
	r->time_of_flight_us = range_cm == RANGE_MAX_CM ? 0 : (uint16_t)(range_cm * US_PER_CM);
	parts_found(side, PART_MAXSONAR, 0);
	return RANGING_DONE;
}

/* A transfer has ended: not acknowledged is the proper answer to the probe, and to no other. */
static enum ranging_state check(uint8_t side, uint32_t now, struct ranging *r, enum twi_state state)
{
	if (state == TWI_FAILED)
		return fail(r, FAULT_BUS_STUCK);
	if ((r->stage == TRIGGERING && state == TWI_NACK) || (r->stage == PROBING && state == TWI_DONE))
		return RANGING_REFUSED;
	if (r->stage == READING && state == TWI_DONE)
		return finish(side, r);
	if (r->stage == TRIGGERING) {
		r->trigger = r->transfer.ticks;
		wait(r, BEFORE_PROBE, r->trigger + PROBE_TICKS);
	} else if (r->stage == PROBING) {
		wait(r, BEFORE_READING, r->trigger + RESULT_MIN_TICKS);
	} else if (ticks_reached(now, r->trigger + RESULT_MAX_TICKS)) {
		return fail(r, FAULT_TOO_LATE);
	} else {
		wait(r, BEFORE_READING, now + POLL_TICKS);
	}
	return RANGING_BUSY;
}

enum ranging_state maxsonar_run(uint8_t side, uint32_t now, struct ranging *r)
{
	if (r->stage == BEFORE_PROBE || r->stage == BEFORE_READING) {
		if (ticks_reached(now, r->due) && bus_is_quiet(now))
			request_result(r);
		r->next = ticks_reached(now, r->due) ? now + POLL_TICKS : r->due;
		return RANGING_BUSY;
	}
	enum twi_state state = twi_state(&r->transfer);
	enum ranging_state result = state == TWI_BUSY ? RANGING_BUSY : check(side, now, r, state);
	r->next = state == TWI_BUSY ? now + RANGER_IDLE_TICKS : r->due;
	return result;
}
