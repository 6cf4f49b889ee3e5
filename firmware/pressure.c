/* SPDX-License-Identifier: MIT */
#include "pressure.h"
#include "board.h"         /* ticks */
#include "bmp390.h"        /* driver */
#include "configuration.h" /* whether it is enabled */
#include "link.h"          /* sending the messages */
#include "scp1000.h"       /* driver */
#include "status.h"        /* error counter */

#define RETRY_TICKS TICKS_PER_S          /* from a failure to the next search */
#define START_UP_TICKS (5u * TICKS_PER_MS) /* of a barometer that got its power together with the board: 2 ms [BMP390] */

static enum { SEARCHING, RUNS_SCP1000, RUNS_BMP390 } state;
static uint32_t due; /* next call of the driver, ticks */

/* The BMP390 is sought first: the SCP1000 takes its frames for reads, while some writes to an SCP1000 would reconfigure a BMP390. */
static uint32_t search(uint32_t now)
{
	if (bmp390_answers()) {
		state = RUNS_BMP390;
		return bmp390_start(now);
	}
	state = RUNS_SCP1000;
	return scp1000_start(now);
}

void pressure_start(uint32_t now)
{
	state = SEARCHING;
	due = now + START_UP_TICKS;
}

uint32_t pressure_failed(uint32_t now, uint8_t fault)
{
	status_failed(DEVICE_PRESSURE, fault);
	state = SEARCHING;
	return now + RETRY_TICKS;
}

void pressure_report(uint32_t now, uint32_t pressure, int16_t temperature)
{
	struct msg_pressure m = { now, pressure, temperature };
	status_ok(DEVICE_PRESSURE);
	link_send(MSG_PRESSURE, msg_pack_pressure(link_body(), &m));
}

uint32_t pressure_run(uint32_t now)
{
	if (!configuration_reads(SENSORS_PRESSURE))
		due = now + RETRY_TICKS;
	if (!ticks_reached(now, due))
		return due;
	if (state == SEARCHING)
		due = search(now);
	else
		due = state == RUNS_BMP390 ? bmp390_run(now) : scp1000_run(now);
	return due;
}
