/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two SRF02 ultrasonic rangers on the I2C bus [SRF02 technical specification].
 *
 * Ranging takes 61 to 62 ms. The first echo after the ring-down counts. */
#include "parts/parts.h"

enum { COMMAND, RANGE_HIGH = 2, RANGE_LOW, MINIMUM_HIGH, MINIMUM_LOW };
enum { /* commands; the units follow each other: inches, cm, us */
	REAL_FIRST = 0x50,
	REAL_LAST = 0x52,
	FAKE_FIRST = 0x56, /* ranging without a burst */
	FAKE_LAST = 0x58,
	BURST = 0x5C, /* without ranging */
	ADDRESS_1 = 0xA0,
	ADDRESS_2 = 0xAA,
	ADDRESS_3 = 0xA5,
	ADDRESS_LOWEST = 0xE0,
};
enum { INCHES, CENTIMETRES, MICROSECONDS };
#define REVISION 6
#define UNUSED 0x80
#define RANGING_US 61000u
#define SPREAD_US 1000u /* random part of a ranging's duration */
#define RING_DOWN_US 875u /* 15 cm, out and back */
#define WINDOW_US 35000u  /* 600 cm */
#define US_PER_CM 58u     /* out and back */
#define US_PER_INCH 148u

static struct ranger rangers[] = {
	{ .twi = { .part = PART(srf02, "srf_left", PLACE_RANGER_LEFT), .address = 0x70 } },
	{ .twi = { .part = PART(srf02, "srf_right", PLACE_RANGER_RIGHT), .address = 0x71 } },
};

static uint16_t result_of(const struct ranger *r, uint32_t us)
{
	return (uint16_t)(r->unit == MICROSECONDS ? us : us / (r->unit == CENTIMETRES ? US_PER_CM : US_PER_INCH));
}

static void begin(struct ranger *r, uint8_t command)
{
	bool burst = command < FAKE_FIRST || command > FAKE_LAST;

	ranger_begin(r, burst);
	if (command == BURST)
		return;
	r->unit = (uint8_t)((command - REAL_FIRST) % (FAKE_FIRST - REAL_FIRST));
	ranger_listen(r, burst ? row.own_us[r - rangers] : 0, avr->cycle + US(RANGING_US + random_below(SPREAD_US)));
}

static bool on_start(struct twi_device *self, bool read)
{
	const struct ranger *r = (struct ranger *)self;

	return !(self->part.fault == MUTE && r->listening) && ranger_start(self, read);
}

static uint8_t on_read(struct twi_device *self)
{
	struct ranger *r = (struct ranger *)self;
	const uint8_t registers[6] = { REVISION, UNUSED, (uint8_t)(r->result >> 8), (uint8_t)r->result, 0, 15 };

	return registers[r->pointer++ % 6];
}

static bool is_ping_command(uint8_t command)
{
	return (command >= REAL_FIRST && command <= REAL_LAST) || (command >= FAKE_FIRST && command <= FAKE_LAST) || command == BURST;
}

static uint8_t next_in_sequence(uint8_t sequence, uint8_t command)
{
	if (command == ADDRESS_1)
		return 1;
	return command == ADDRESS_2 && sequence == 1 ? 2 : command == ADDRESS_3 && sequence == 2 ? 3 : 0;
}

/* Commands take effect at the stop condition. Address change: ADDRESS_1, _2, _3, then the new 8-bit address, each as a command. */
static void on_stop(struct twi_device *self)
{
	struct ranger *r = (struct ranger *)self;
	uint8_t command = r->written[1];

	if (r->count >= 2 && r->written[0] == COMMAND) {
		if (is_ping_command(command))
			begin(r, command);
		else if (r->sequence == 3 && command >= ADDRESS_LOWEST && !(command & 1))
			self->address = command >> 1;
		r->sequence = next_in_sequence(r->sequence, command);
	}
	r->count = 0;
}

/* A ranging that a mute ranger has finished has no result. */
static void changed(struct part *part, unsigned before)
{
	struct ranger *r = (struct ranger *)part;

	if (part->fault != MUTE)
		r->listening = r->listening && avr->cycle < r->busy_until;
}

const struct model srf02 = {
	.kind = OF_PAPERS,
	.faults = "ok absent nack stretch mute deaf",
	PARTS(rangers),
	.wire = twi_wire,
	.power = ranger_power,
	.changed = changed,
	.start = on_start,
	.write = ranger_write,
	.read = on_read,
	.stop = on_stop,
	.fault_stretch_us = 500,
	.result_of = result_of,
	.least_us = RING_DOWN_US,
	.window_us = WINDOW_US,
};
