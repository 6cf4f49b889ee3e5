/* SPDX-License-Identifier: GPL-3.0-or-later
 * What rangers have in common. Those on I2C do not acknowledge their address while they range; the result is the first
 * echo in the model's window, of the own burst or of the other ranger's. */
#include "parts/parts.h"

const char *const sides[2] = { "left", "right" };

void bursts_add(const struct model *model, struct bursts *own, unsigned side, avr_cycle_count_t at)
{
	uint32_t late_us = model->fades_us ? model->fades_us() : 0;

	own->last[own->count++ % 4] = (struct burst){ at, input.row.cross_us[!side], late_us };
	bench_trace("trigger %s", sides[side]);
}

uint32_t bursts_first_echo(const struct model *model, const struct bursts *others,
                           avr_cycle_count_t began, uint16_t own_us)
{
	int64_t least = model->least_us, none = (int64_t)(model->listens_us ? model->listens_us() : model->window_us) + 1;
	int64_t first = own_us >= least && own_us < none ? own_us : none;

	for (int k = 0; k < 4; k++) {
		const struct burst *b = &others->last[k];
		int64_t at_us = ((int64_t)b->at - (int64_t)began) / 16;

		if (b->cross_us && at_us + b->cross_us >= least && at_us + b->cross_us < first)
			first = at_us + b->cross_us;
		if (b->late_us && at_us + b->late_us >= least && at_us + b->late_us < first)
			first = at_us + b->late_us;
	}
	return first == none ? 0 : (uint32_t)first;
}

static unsigned side_of(const struct ranger *r)
{
	return r->twi.part.place == PLACE_RANGER_RIGHT;
}

static struct ranger *other_of(const struct ranger *r)
{
	return (struct ranger *)r->twi.part.model->parts + !side_of(r);
}

static void finish(struct ranger *r)
{
	uint32_t us = bursts_first_echo(r->twi.part.model, &other_of(r)->bursts, r->began, r->own_us);

	r->listening = false;
	r->result_us = r->twi.part.fault.value == DEAF ? 0 : us;
}

void ranger_ping(struct ranger *r, avr_cycle_count_t busy_until)
{
	struct ranger *other = other_of(r);

	if (other->listening && avr->cycle >= other->busy_until && other->twi.part.fault.value != MUTE)
		finish(other); /* this ping may overwrite one that the other ranger's result needs */
	bursts_add(r->twi.part.model, &r->bursts, side_of(r), avr->cycle);
	r->began = avr->cycle;
	r->own_us = input.row.own_us[side_of(r)];
	r->listening = true;
	r->busy_until = busy_until;
}

bool ranger_start(void *self, bool read)
{
	struct ranger *r = self;

	if (r->twi.part.fault.value == NACK || avr->cycle < r->busy_until)
		return false;
	if (r->listening)
		finish(r);
	if (!read)
		r->count = 0;
	return true;
}

bool ranger_write(void *self, uint8_t byte, bool first)
{
	struct ranger *r = self;

	if (first)
		r->pointer = byte;
	if (r->count < sizeof r->written)
		r->written[r->count] = byte;
	r->count++;
	return true;
}

void ranger_power(void *self)
{
	struct ranger *r = self;

	r->listening = false;
	r->busy_until = 0;
	r->count = 0;
	r->bursts = (struct bursts){ 0 };
}
