/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rangers: their last bursts, for the other one hears them too, and what those on I2C have in common. While one ranges, it does not acknowledge
 * its address. The result is the first echo in its window: of its own burst, or of the other ranger's. */
#include "parts/parts.h"

#define BURSTS (sizeof(((struct bursts *)0)->last) / sizeof(struct burst))

void bursts_add(struct bursts *own, avr_cycle_count_t at, uint16_t cross_us)
{
	own->last[own->count++ % BURSTS] = (struct burst){ at, cross_us };
}

uint32_t bursts_first_echo(const struct bursts *others, avr_cycle_count_t began, uint16_t own_us, uint32_t least_us, uint32_t window_us)
{
	int64_t none = (int64_t)window_us + 1, first = own_us >= least_us && own_us <= window_us ? own_us : none;

	for (unsigned k = 0; k < BURSTS; k++) {
		const struct burst *b = &others->last[k];
		int64_t us = ((int64_t)b->at - (int64_t)began) / 16 + b->cross_us;

		if (b->cross_us && us >= least_us && us < first)
			first = us;
	}
	return first == none ? 0 : (uint32_t)first;
}

unsigned ranger_side(const struct part *part)
{
	return part->place == PLACE_RANGER_RIGHT;
}

static struct ranger *other_of(const struct ranger *r)
{
	return (struct ranger *)r->twi.part.model->parts + !ranger_side(&r->twi.part);
}

static void finish(struct ranger *r)
{
	const struct model *m = r->twi.part.model;
	uint32_t us = bursts_first_echo(&other_of(r)->bursts, r->began, r->own_us, m->least_us, m->window_us);

	r->listening = false;
	r->result = m->result_of(r, r->twi.part.fault == DEAF ? 0 : us);
}

void ranger_begin(struct ranger *r, bool burst)
{
	unsigned side = ranger_side(&r->twi.part);
	struct ranger *other = other_of(r);

	if (other->listening && avr->cycle >= other->busy_until)
		finish(other); /* this ping may overwrite one that the other ranger's result needs */
	if (burst) {
		bursts_add(&r->bursts, avr->cycle, row.cross_us[!side]);
		bench_trace("trigger %s", side ? "right" : "left");
	}
}

void ranger_listen(struct ranger *r, uint16_t own_us, avr_cycle_count_t until)
{
	r->began = avr->cycle;
	r->own_us = own_us;
	r->listening = true;
	r->busy_until = until;
}

bool ranger_start(struct twi_device *self, bool read)
{
	struct ranger *r = (struct ranger *)self;

	if (self->part.fault == NACK || avr->cycle < r->busy_until)
		return false;
	if (r->listening)
		finish(r);
	if (!read)
		r->count = 0;
	return true;
}

bool ranger_write(struct twi_device *self, uint8_t byte)
{
	struct ranger *r = (struct ranger *)self;

	if (r->count == 0)
		r->pointer = byte;
	if (r->count < sizeof r->written)
		r->written[r->count++] = byte;
	return true;
}

void ranger_power(struct part *part)
{
	struct ranger *r = (struct ranger *)part;

	r->listening = false;
	r->busy_until = 0;
	r->count = r->sequence = 0;
	r->bursts = (struct bursts){ 0 };
}
