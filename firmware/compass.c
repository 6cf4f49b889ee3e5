/* SPDX-License-Identifier: MIT */
#include "compass.h"
#include "board.h"         /* twi_* */
#include "bus.h"           /* it is kept free for triggers */
#include "cmps10.h"        /* driver */
#include "configuration.h" /* rate, whether it is enabled */
#include "lis3mdl.h"       /* driver */
#include "status.h"        /* error counter */

#define RETRY_TICKS TICKS_PER_MS /* when the bus is in use, or a trigger is near */
#define FIRST_SAMPLE_TICKS (50u * TICKS_PER_MS) /* of a LIS3MDL; it measures at 80 Hz */
#define CHECK_TICKS TICKS_PER_S  /* between two readings of its settings */
#define MISSES_MAX 10u           /* readings in a row that failed, a second, after which either part is sought again */

/* A CMPS10 is assumed where no LIS3MDL answers. */
static enum { SEEK_FIRST, SEEK_SECOND, START_FIRST, START_SECOND, CHECK, READS_LIS3MDL, READS_CMPS10 } state;
static struct twi_transfer transfer;
static bool second;     /* the LIS3MDL is at its second address */
static bool reading;    /* a transfer is under way */
static uint8_t misses;  /* readings in a row that failed */
static uint32_t due;    /* next transfer, ticks */
static uint32_t period; /* between readings, ticks */
static uint32_t check_due; /* of a LIS3MDL's settings, ticks */

void compass_start(uint32_t now)
{
	due = now;
	period = TICKS_PER_S / configuration.compass_rate_hz;
}

static uint8_t fault_of(enum twi_state bus)
{
	return bus == TWI_DONE ? FAULT_NONE : bus == TWI_NACK ? FAULT_NO_ANSWER : FAULT_BUS_STUCK;
}

/* One transfer of the search: the identity at either address, then the settings; or of their check. */
static void seek_on(enum twi_state bus, uint32_t now)
{
	bool done = bus == TWI_DONE;
	if (state == SEEK_FIRST || state == SEEK_SECOND) {
		second = state == SEEK_SECOND;
		if (done && lis3mdl_answers(&transfer))
			state = START_FIRST;
		else
			state = second ? READS_CMPS10 : SEEK_SECOND;
	} else if (state == CHECK) {
		bool equal = !done || lis3mdl_is_set(&transfer);
		state = equal ? READS_LIS3MDL : START_FIRST;
		if (!equal)
			status_failed(DEVICE_COMPASS, FAULT_BAD_VALUE);
	} else {
		state = !done ? SEEK_FIRST : state == START_FIRST ? START_SECOND : READS_LIS3MDL;
		due = state == READS_LIS3MDL ? now + FIRST_SAMPLE_TICKS : due;
		check_due = now;
	}
}

static void note(uint8_t fault, uint32_t now)
{
	if (fault == FAULT_NONE) {
		misses = 0;
		status_ok(DEVICE_COMPASS);
		return;
	}
	status_failed(DEVICE_COMPASS, fault);
	if (state == READS_CMPS10 && fault != FAULT_BAD_VALUE)
		cmps10_send_none(now);
	if (++misses >= MISSES_MAX) {
		misses = 0;
		state = SEEK_FIRST;
	}
}

static void finish(enum twi_state bus, uint32_t now)
{
	uint8_t fault = fault_of(bus);
	reading = false;
	if (state < READS_LIS3MDL) {
		seek_on(bus, now);
		return;
	}
	if (fault == FAULT_NONE)
		fault = state == READS_LIS3MDL ? lis3mdl_finish(&transfer) : cmps10_finish(&transfer);
	if (fault == LIS3MDL_AGAIN)
		due -= period; /* at once */
	else
		note(fault, now);
}

static void prepare(uint32_t now)
{
	if (state == READS_LIS3MDL && ticks_reached(now, check_due)) {
		state = CHECK;
		check_due = now + CHECK_TICKS;
	}
	if (state == READS_CMPS10)
		cmps10_prepare(&transfer);
	else if (state == READS_LIS3MDL)
		lis3mdl_prepare(&transfer, LIS3MDL_SAMPLE, second);
	else if (state == START_FIRST || state == START_SECOND)
		lis3mdl_prepare(&transfer, state == START_FIRST ? LIS3MDL_SETTINGS : LIS3MDL_MORE_SETTINGS, second);
	else if (state == CHECK)
		lis3mdl_prepare(&transfer, LIS3MDL_CHECK, second);
	else
		lis3mdl_prepare(&transfer, LIS3MDL_IDENTITY, state == SEEK_SECOND);
}

/* Starts a transfer if the bus is free, and then sets the time of the next one: those of the search follow each
 * other. */
static void begin(uint32_t now)
{
	prepare(now);
	reading = twi_begin(&transfer);
	if (!reading || state < READS_LIS3MDL)
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
	if (!reading && ticks_reached(now, due) && bus_is_quiet(now))
		begin(now);
	return ticks_reached(now, due) ? now + RETRY_TICKS : due;
}
