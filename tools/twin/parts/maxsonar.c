/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two I2CXL-MaxSonar-EZ ultrasonic rangers on the I2C bus [MaxBotix PD11848].
 *
 * One byte starts a ranging, from 25 ms for near things to 67 ms. A read gives the last range in cm, high byte first; things that are nearer
 * than the least range are given as that. It stretches the clock. */
#include "parts/parts.h"

enum { TAKE_RANGE = 81, UNLOCK_1 = 170, UNLOCK_2 = 165 };
#define OVERHEAD_US 22000u /* of a ranging, beside the time of flight; assumed from the two durations */
#define SPREAD_US 1000u    /* random part of it */
#define LEAST_US 1450u     /* 25 cm, out and back */
#define WINDOW_US 44370u   /* 765 cm */
#define US_PER_CM 58u      /* out and back */
#define NO_ECHO_CM 765u
#define PART_INFORMATION 0x2A2Au /* before the first ranging; the data sheet does not give the bytes */
#define MISREAD 0x8000u    /* as if the first bit were taken too early: seen where a master ignored the stretching */
#define STRETCH_US 20      /* after each byte; assumed */
#define NEVER UINT64_MAX

static struct ranger rangers[] = {
	{ .twi = { .part = PART(maxsonar, "maxsonar_left", PLACE_RANGER_LEFT), .address = 0x70 } },
	{ .twi = { .part = PART(maxsonar, "maxsonar_right", PLACE_RANGER_RIGHT), .address = 0x71 } },
};

static uint16_t result_of(const struct ranger *r, uint32_t us)
{
	return (uint16_t)(!us ? NO_ECHO_CM : ((us < LEAST_US ? LEAST_US : us) + US_PER_CM / 2) / US_PER_CM);
}

static void begin(struct ranger *r)
{
	uint32_t own_us = row.own_us[r - rangers], flight_us = own_us && own_us < WINDOW_US ? own_us : WINDOW_US;

	ranger_begin(r, true);
	ranger_listen(r, (uint16_t)own_us, r->twi.part.fault == MUTE ? NEVER : avr->cycle + US(OVERHEAD_US + flight_us + random_below(SPREAD_US)));
}

static bool on_start(struct twi_device *self, bool read)
{
	if (read)
		((struct ranger *)self)->pointer = 0;
	return ranger_start(self, read);
}

static uint8_t on_read(struct twi_device *self)
{
	struct ranger *r = (struct ranger *)self;
	unsigned word = self->part.fault == MISREADS ? r->result | MISREAD : r->result;

	switch (r->pointer++) {
	case 0: return (uint8_t)(word >> 8);
	case 1: return (uint8_t)word;
	default: return 0xFF;
	}
}

/* A command that the data sheet does not have is taken to do nothing. */
static void on_stop(struct twi_device *self)
{
	struct ranger *r = (struct ranger *)self;

	if (r->count == 1 && r->written[0] == TAKE_RANGE)
		begin(r);
	else if (r->count == 3 && r->written[0] == UNLOCK_1 && r->written[1] == UNLOCK_2)
		self->address = r->written[2] >> 1;
	r->count = 0;
}

static void power(struct part *part)
{
	ranger_power(part);
	((struct ranger *)part)->result = PART_INFORMATION;
}

static void changed(struct part *part, unsigned before)
{
	struct ranger *r = (struct ranger *)part;

	if (part->fault != MUTE && r->busy_until == NEVER)
		r->busy_until = avr->cycle;
}

const struct model maxsonar = {
	.kind = MAXSONAR,
	.faults = "ok absent nack stretch mute deaf misread",
	PARTS(rangers),
	.wire = twi_wire,
	.power = power,
	.changed = changed,
	.start = on_start,
	.write = ranger_write,
	.read = on_read,
	.stop = on_stop,
	.stretch_us = STRETCH_US,
	.fault_stretch_us = 500,
	.result_of = result_of,
	.least_us = 1,
	.window_us = WINDOW_US,
};
