/* SPDX-License-Identifier: MIT */
#include "compass.h"
#include "board.h"         /* twi_* */
#include "configuration.h" /* rate, whether it is enabled */
#include "link.h"          /* sending the messages */
#include "parts.h"         /* what was found */
#include "ranger.h"        /* ranger_quiet: the bus is kept free for triggers */
#include "status.h"        /* error counter */

/* Bearing in 0.1 degrees, big-endian, in registers 2 and 3 [Devantech CMPS10 documentation]. */
#define ADDRESS 0x60u
#define REGISTER_BEARING 2u
#define BEARING_MAX 3599u

#define RETRY_TICKS TICKS_PER_MS /* when the bus is in use, or a trigger is near */

static struct twi_transfer transfer;
static bool reading;    /* a transfer is under way */
static uint32_t due;    /* next reading, ticks */
static uint32_t period; /* between readings, ticks */

void compass_start(uint32_t now)
{
	due = now;
	period = TICKS_PER_S / configuration.compass_rate_hz;
}

static void report(uint32_t ticks, uint16_t bearing)
{
	struct msg_compass m = { ticks, bearing };
	link_send(MSG_COMPASS, msg_pack_compass(link_body(), &m));
}

static void finish(enum twi_state state, uint32_t now)
{
	uint16_t bearing = (uint16_t)((uint16_t)(transfer.bytes[0] << 8) | transfer.bytes[1]);
	reading = false;
	if (state == TWI_DONE && bearing <= BEARING_MAX) {
		status_ok(DEVICE_COMPASS);
		parts_found(DEVICE_COMPASS, PART_CMPS10, 0);
		report(transfer.ticks, bearing);
	} else {
		status_failed(DEVICE_COMPASS, state == TWI_DONE ? FAULT_BAD_VALUE : state == TWI_NACK ? FAULT_NO_ANSWER : FAULT_BUS_STUCK);
		report(now, MSG_COMPASS_BEARING_INVALID);
	}
}

/* Starts a transfer if the bus is free, and then sets the time of the next one. */
static void begin(uint32_t now)
{
	transfer.address = ADDRESS;
	transfer.write_length = 1;
	transfer.read_length = 2;
	transfer.bytes[0] = REGISTER_BEARING;
	reading = twi_begin(&transfer);
	if (!reading)
		return;
	due += period;
	if (ticks_reached(now, due))
		due = now + period;
}

uint32_t compass_run(uint32_t now)
{
	if (reading && twi_state(&transfer) != TWI_BUSY)
		finish(twi_state(&transfer), now);
	if (!configuration_reads(SENSORS_COMPASS)) {
		due = now + period;
		return due;
	}
	if (!reading && ticks_reached(now, due) && ranger_quiet(now))
		begin(now);
	return ticks_reached(now, due) ? now + RETRY_TICKS : due;
}
