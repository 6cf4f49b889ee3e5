/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two I2CXL-MaxSonar-EZ ultrasonic rangers on the I2C bus [MaxBotix PD11848].
 *
 * One byte starts a ranging, from 25 ms for near things to 67 ms; during this time the device does not acknowledge its address. A read gives
 * the last range in cm, high byte first; things that are nearer than the least range are given as that. It stretches the clock. */
#include <string.h>

#include "twin.h"

enum { TAKE_RANGE = 81, UNLOCK_1 = 170, UNLOCK_2 = 165 };
#define DEFAULT_ADDRESS 0x70
#define OVERHEAD_US 22000u /* of a ranging, beside the time of flight; assumed from the two durations */
#define SPREAD_US 1000u    /* random part of it */
#define LEAST_US 1450u     /* 25 cm, out and back */
#define WINDOW_US 44370u   /* 765 cm */
#define US_PER_CM 58u      /* out and back */
#define NO_ECHO_CM 765u
#define PART_INFORMATION 0x2A2Au /* before the first ranging; the data sheet does not give the bytes */
#define MISREAD 0x8000u    /* as if the first bit were taken too early: seen where a master ignored the stretching */
#define STRETCH US(20)     /* after each byte; assumed */
#define LONG_STRETCH US(500)
#define NEVER UINT64_MAX

static struct ranger {
	struct twi_device twi;
	const char *name;
	enum place place;
	enum fault { GOOD, ABSENT, NACK, LONG_STRETCHES, MUTE, DEAF, MISREADS, FAULTS } fault;
	uint8_t written[3], count; /* bytes of the write under way */
	unsigned read;             /* bytes of the read under way */
	avr_cycle_count_t began, busy_until;
	bool listening;
	uint16_t own_us, result;
	struct bursts bursts;
} rangers[2] = { { .name = "left", .place = PLACE_RANGER_LEFT }, { .name = "right", .place = PLACE_RANGER_RIGHT } };
static const char *const fault_names[FAULTS] = { "ok", "absent", "nack", "stretch", "mute", "deaf", "misread" };

static void finish(struct ranger *r)
{
	uint32_t us = r->fault == DEAF ? 0 : bursts_first_echo(&rangers[r == rangers].bursts, r->began, r->own_us, 1, WINDOW_US);

	r->listening = false;
	r->result = (uint16_t)(!us ? NO_ECHO_CM : ((us < LEAST_US ? LEAST_US : us) + US_PER_CM / 2) / US_PER_CM);
}

static void begin(struct ranger *r)
{
	struct ranger *other = &rangers[r == rangers];
	uint32_t own_us = row.own_us[r - rangers];

	if (other->listening && avr->cycle >= other->busy_until)
		finish(other); /* this ping may overwrite one that the other ranger's result needs */
	bursts_add(&r->bursts, avr->cycle, row.cross_us[r == rangers]);
	bench_trace("trigger %s", r->name);
	r->began = avr->cycle;
	r->own_us = (uint16_t)own_us;
	r->listening = true;
	r->busy_until = r->fault == MUTE ? NEVER : avr->cycle + US(OVERHEAD_US + (own_us && own_us < WINDOW_US ? own_us : WINDOW_US) + random_below(SPREAD_US));
}

static bool on_start(struct twi_device *self, bool read)
{
	struct ranger *r = (struct ranger *)self;

	if (!kit_has_maxsonar(r->place) || r->fault == ABSENT || r->fault == NACK || avr->cycle < r->busy_until)
		return false;
	if (r->listening)
		finish(r);
	if (read)
		r->read = 0;
	else
		r->count = 0;
	self->stretch = r->fault == LONG_STRETCHES ? LONG_STRETCH : STRETCH;
	return true;
}

static bool on_write(struct twi_device *self, uint8_t byte)
{
	struct ranger *r = (struct ranger *)self;

	if (r->count < sizeof r->written)
		r->written[r->count++] = byte;
	return true;
}

static uint8_t on_read(struct twi_device *self)
{
	struct ranger *r = (struct ranger *)self;
	unsigned word = r->fault == MISREADS ? r->result | MISREAD : r->result;

	switch (r->read++) {
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
	self->stretch = 0;
}

void maxsonar_power(void)
{
	for (int k = 0; k < 2; k++) {
		struct ranger *r = &rangers[k];

		if (!r->twi.start) {
			r->twi = (struct twi_device){ (uint8_t)(DEFAULT_ADDRESS + k), on_start, on_write, on_read, on_stop, 0, NULL };
			twi_add(&r->twi);
		}
		r->listening = false;
		r->busy_until = 0;
		r->count = 0;
		r->result = PART_INFORMATION;
		r->bursts = (struct bursts){ 0 };
	}
}

bool maxsonar_fault(const char *name, const char *value)
{
	if (strncmp(name, "maxsonar_", 9))
		return false;
	for (int k = 0; k < 2; k++)
		for (int f = 0; !strcmp(name + 9, rangers[k].name) && f < FAULTS; f++)
			if (!strcmp(value, fault_names[f])) {
				rangers[k].fault = (enum fault)f;
				if (f != MUTE && rangers[k].busy_until == NEVER)
					rangers[k].busy_until = avr->cycle;
				return true;
			}
	return false;
}
