/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two I2CXL-MaxSonar-EZ ultrasonic rangers on the I2C bus [MaxBotix PD11848].
 *
 * One byte starts a ranging, from 25 ms for near things to 67 ms. A read gives the last range in cm, high byte first;
 * things that are nearer than the least range are given as that. It stretches the clock. */
#include "parts/parts.h"

#define TAKE_RANGE 81
#define OVERHEAD_US 22000u /* of a ranging, beside the time of flight; assumed from the two durations */
#define SPREAD_US 1000u    /* random part of it */
#define LEAST_US 1450u     /* 25 cm, out and back */
#define WINDOW_US 44370u   /* 765 cm */
#define US_PER_CM 58u      /* out and back */
#define NO_ECHO_CM 765u
#define PART_INFORMATION 0x2A2Au /* before the first ranging; the data sheet does not give the bytes */
#define MISREAD 0x8000u    /* as if the first bit were taken too early: seen where a master ignored the stretching */
#define NEVER UINT64_MAX

static struct ranger rangers[] = {
	{ .twi = { .part = PART(maxsonar, PLACE_RANGER_LEFT, "maxsonar_left"), .address = 0x70 } },
	{ .twi = { .part = PART(maxsonar, PLACE_RANGER_RIGHT, "maxsonar_right"), .address = 0x71 } },
};

static bool on_start(void *self, bool read)
{
	if (read)
		((struct ranger *)self)->pointer = 0;
	return ranger_start(self, read);
}

static unsigned range_cm(const struct ranger *r)
{
	uint32_t us = r->result_us;

	if (us == UINT32_MAX)
		return PART_INFORMATION;
	return us ? ((us < LEAST_US ? LEAST_US : us) + US_PER_CM / 2) / US_PER_CM : NO_ECHO_CM;
}

static uint8_t on_read(void *self)
{
	struct ranger *r = self;
	unsigned word = range_cm(r) | (r->twi.part.fault.value == MISREADS ? MISREAD : 0);

	switch (r->pointer++) {
	case 0: return (uint8_t)(word >> 8);
	case 1: return (uint8_t)word;
	default: return 0xFF;
	}
}

static void on_stop(void *self)
{
	struct ranger *r = self;
	uint32_t own_us = input.row.own_us[r - rangers], flight_us = own_us && own_us < WINDOW_US ? own_us : WINDOW_US;

	if (r->count == 1 && r->written[0] == TAKE_RANGE) {
		avr_cycle_count_t end = avr->cycle + US(OVERHEAD_US + flight_us + random_below(SPREAD_US));

		ranger_ping(r, r->twi.part.fault.value == MUTE ? NEVER : end);
	}
	r->count = 0;
}

static void power(void *self)
{
	ranger_power(self);
	((struct ranger *)self)->result_us = UINT32_MAX;
}

static void changed(void *self, unsigned before)
{
	struct ranger *r = self;

	if (r->twi.part.fault.value != MUTE && r->busy_until == NEVER)
		r->busy_until = avr->cycle;
}

const struct model maxsonar = {
	.kind = MAXSONAR,
	.faults = "ok absent nack stretch mute deaf misread",
	PARTS(rangers),
	.power = power,
	.changed = changed,
	.start = on_start,
	.write = ranger_write,
	.read = on_read,
	.stop = on_stop,
	.stretch_us = 20, /* after each byte; assumed */
	.fault_stretch_us = 500,
	.least_us = 1, /* a nearer echo is given as LEAST_US */
	.window_us = WINDOW_US,
};
