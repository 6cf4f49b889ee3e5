/* SPDX-License-Identifier: MIT */
#include "pressure.h"
#include "board.h"         /* ticks */
#include "bmp390.h"        /* driver */
#include "configuration.h" /* whether it is enabled */
#include "link.h"          /* sending the messages */
#include "scp1000.h"       /* driver */
#include "status.h"        /* error counter */

#define RETRY_TICKS TICKS_PER_S          /* from a failure to the next search */
#define POLL_TICKS (5u * TICKS_PER_MS)   /* between two steps of a driver */
/* when the LSM6DSO have I3C off, which frames for a barometer may confuse; a BMP390 takes 2 ms */
#define START_UP_TICKS (150u * TICKS_PER_MS)

static enum { SEARCHING, RUNS_SCP1000, RUNS_BMP390 } state;
static uint32_t due; /* next step, ticks */

/* The BMP390 is sought first: the SCP1000 takes its frames for reads, while some writes to an SCP1000 would reconfigure
 * a BMP390. */
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

static void report(uint32_t now, const struct pressure_step *step)
{
	struct msg_pressure m = { now, step->pressure, step->temperature };
	status_ok(DEVICE_PRESSURE);
	link_send(MSG_PRESSURE, msg_pack_pressure(link_body(), &m));
}

/* Runs the driver; returns the time of its next step, or of the next search. */
static uint32_t advance(uint32_t now)
{
	struct pressure_step step = { .fault = FAULT_NONE };
	if (state == RUNS_BMP390)
		bmp390_run(now, &step);
	else
		scp1000_run(now, &step);
	if (step.wrong_bits)
		status_failed(DEVICE_PRESSURE, FAULT_BAD_VALUE);
	if (step.pressure)
		report(now, &step);
	if (step.fault == FAULT_NONE)
		return now + POLL_TICKS;
	status_failed(DEVICE_PRESSURE, step.fault);
	state = SEARCHING;
	return now + RETRY_TICKS;
}

uint32_t pressure_run(uint32_t now)
{
	if (!configuration_reads(SENSORS_PRESSURE))
		due = now + RETRY_TICKS;
	if (!ticks_reached(now, due))
		return due;
	due = state == SEARCHING ? search(now) : advance(now);
	return due;
}
