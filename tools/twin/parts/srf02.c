/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two SRF02 ultrasonic rangers on the I2C bus [SRF02 technical specification].
 *
 * Ranging takes 61 to 62 ms; during this time the device does not acknowledge its address. The result is the first echo after the
 * ring-down and within the listening window: of its own ping, or of the other ranger's ping. */
#include <string.h>

#include "twin.h"

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
#define STRETCH US(500)

static struct ranger {
	struct twi_device twi;
	const char *name;
	int side;
	bool absent, refuses, stretches, mute, deaf;
	uint8_t pointer;           /* register of the next read */
	uint8_t written[2], count; /* bytes of the write under way */
	uint8_t sequence;          /* commands of an address change so far */
	avr_cycle_count_t busy_until, began;
	bool emitted, listening; /* of the ranging under way: has an own ping; not finished */
	uint8_t unit;            /* of the result */
	uint16_t own_us, result;
	struct bursts bursts;
} rangers[2] = { { .name = "left", .side = 0 }, { .name = "right", .side = 1 } };

static void finish(struct ranger *r)
{
	uint32_t us = bursts_first_echo(&rangers[1 - r->side].bursts, r->began, r->emitted ? r->own_us : 0, RING_DOWN_US, WINDOW_US);

	r->listening = false;
	if (r->deaf)
		us = 0;
	r->result = (uint16_t)(r->unit == MICROSECONDS ? us : us / (r->unit == CENTIMETRES ? US_PER_CM : US_PER_INCH));
}

static void begin(struct ranger *r, uint8_t command)
{
	struct ranger *other = &rangers[1 - r->side];
	bool burst = command < FAKE_FIRST || command > FAKE_LAST;

	if (other->listening && avr->cycle >= other->busy_until)
		finish(other); /* this ping may overwrite one that the other ranger's result needs */
	if (burst) {
		bursts_add(&r->bursts, avr->cycle, row.cross_us[1 - r->side]);
		bench_trace("trigger %s", r->name);
	}
	if (command == BURST)
		return;
	r->began = avr->cycle;
	r->emitted = burst;
	r->own_us = row.own_us[r->side];
	r->unit = (uint8_t)((command - REAL_FIRST) % (FAKE_FIRST - REAL_FIRST));
	r->listening = true;
	r->busy_until = avr->cycle + US(RANGING_US + random_below(SPREAD_US));
}

static bool on_start(struct twi_device *self, bool read)
{
	struct ranger *r = (struct ranger *)self;

	if (!kit_of_papers((enum place)(PLACE_RANGER_LEFT + r->side)) || r->absent || r->refuses || (r->mute && r->listening) || avr->cycle < r->busy_until)
		return false;
	if (r->listening)
		finish(r);
	if (!read)
		r->count = 0;
	self->stretch = r->stretches ? STRETCH : 0;
	return true;
}

static bool on_write(struct twi_device *self, uint8_t byte)
{
	struct ranger *r = (struct ranger *)self;

	if (r->count == 0)
		r->pointer = byte;
	if (r->count < sizeof r->written)
		r->written[r->count++] = byte;
	return true;
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

	if (r->count == 2 && r->written[0] == COMMAND) {
		if (is_ping_command(command))
			begin(r, command);
		else if (r->sequence == 3 && command >= ADDRESS_LOWEST && !(command & 1))
			self->address = command >> 1;
		r->sequence = next_in_sequence(r->sequence, command);
	}
	r->count = 0;
	self->stretch = 0;
}

void srf02_power(void)
{
	for (int k = 0; k < 2; k++) {
		struct ranger *r = &rangers[k];

		if (!r->twi.start) {
			r->twi = (struct twi_device){ (uint8_t)(0x70 + k), on_start, on_write, on_read, on_stop, 0, NULL };
			twi_add(&r->twi);
		}
		r->listening = false;
		r->busy_until = 0;
		r->count = r->sequence = 0;
		r->bursts = (struct bursts){ 0 };
	}
}

bool srf02_fault(const char *name, const char *value)
{
	if (strncmp(name, "srf_", 4))
		return false;
	for (int k = 0; k < 2; k++)
		if (!strcmp(name + 4, rangers[k].name)) {
			struct ranger *r = &rangers[k];

			r->absent = !strcmp(value, "absent");
			r->refuses = !strcmp(value, "nack");
			r->stretches = !strcmp(value, "stretch");
			r->mute = !strcmp(value, "mute");
			r->deaf = !strcmp(value, "deaf");
			if (!r->mute)
				r->listening = r->listening && avr->cycle < r->busy_until;
			return r->absent || r->refuses || r->stretches || r->mute || r->deaf || !strcmp(value, "ok");
		}
	return false;
}
