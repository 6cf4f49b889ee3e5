/* SPDX-License-Identifier: GPL-3.0-or-later
 * All chips, and which one is plugged in in each place: that of the papers, that of the kit of 2026, none, on a foot
 * board, or a MaxSonar. A part that is plugged in gets its power anew, and so do the others of its model. */
#include <simavr/sim_cycle_timers.h>

#include "parts/parts.h"

static const struct model *const models[] = {
	&srf02, &adis16100, &scp1000, &compass, &bmp390, &lis3mdl, &lsm6dso, &pulse, &maxsonar, &icm20649,
};
static struct part *parts;

struct socket {
	struct fault_switch kind;
	const struct model *models[2]; /* that get their power anew */
};

static void plug(void *self, unsigned before)
{
	const struct socket *s = self;

	for (const struct part *p = parts; p; p = p->next)
		if ((p->model == s->models[0] || p->model == s->models[1]) && p->model->power)
			p->model->power((void *)p);
}
#define SOCKET(place, parts) { .name = (place), .values = (parts), .changed = plug }

static struct socket sockets[PLACES] = {
	[PLACE_FOOT] = { .models = { &icm20649 } },
	[PLACE_RANGER_LEFT] = { SOCKET("part_ranger_left", "srf02 pulse maxsonar"), { &pulse, &maxsonar } },
	[PLACE_RANGER_RIGHT] = { SOCKET("part_ranger_right", "srf02 pulse maxsonar"), { &pulse, &maxsonar } },
	[PLACE_COMPASS] = { SOCKET("part_compass", "cmps10 lis3mdl"), { &lis3mdl } },
	[PLACE_THIGH] = { SOCKET("part_thigh", "adis16100 lsm6dso"), { &lsm6dso } },
	[PLACE_CALF] = { SOCKET("part_calf", "adis16100 lsm6dso"), { &lsm6dso } },
	[PLACE_BELT] = { SOCKET("part_belt", "adis16100 lsm6dso"), { &lsm6dso } },
	[PLACE_PRESSURE] = { SOCKET("part_pressure", "scp1000 bmp390"), { &bmp390 } },
};

static void plug_all(void *self, unsigned before)
{
	static const enum kind kinds[] = { OF_PAPERS, OF_2026, OF_FOOT };
	enum kind kind = kinds[((struct fault_switch *)self)->value];

	drive_pin('D', 4, false);
	for (int k = 0; k < PLACES; k++) {
		sockets[k].kind.value = kind;
		plug(&sockets[k], 0);
	}
}
FAULT_SWITCH(kit, "papers 2026 foot", plug_all, 0)

bool place_has(enum place place, enum kind kind)
{
	return sockets[place].kind.value == kind;
}

bool part_is_plugged(const struct part *part)
{
	return place_has(part->place, part->model->kind);
}

bool part_is_here(const struct part *part)
{
	return part_is_plugged(part) && part->fault.value != ABSENT;
}

unsigned parts_here(const struct model *model)
{
	unsigned count = 0;

	for (const struct part *p = parts; p; p = p->next)
		count += p->model == model && part_is_here(p);
	return count;
}

void part_returned(void *self, unsigned before)
{
	if (before == ABSENT)
		((struct part *)self)->model->power(self);
}

static avr_cycle_count_t sample(avr_t *a, avr_cycle_count_t when, void *param)
{
	struct part *part = param;
	avr_cycle_count_t cycles = part->model->sample(part);

	part->sample_at = cycles ? when + cycles : 0;
	return part->sample_at;
}

void part_sample_after(void *self, avr_cycle_count_t cycles)
{
	avr_cycle_timer_cancel(avr, sample, self);
	if (cycles)
		avr_cycle_timer_register(avr, cycles, sample, self);
	((struct part *)self)->sample_at = cycles ? avr->cycle + cycles : 0;
}

static void add(struct part *part)
{
	const struct model *m = part->model;

	part->fault.values = m->faults;
	part->fault.changed = m->changed;
	fault_switch_add(&part->fault);
	if (m->wire)
		m->wire(part);
	if (m->exchange)
		spi_add((struct spi_device *)part);
	if (m->read)
		twi_add((struct twi_device *)part);
}

void parts_init(void)
{
	struct part **end = &parts;

	for (size_t m = 0; m < sizeof models / sizeof *models; m++)
		for (size_t k = 0; k < models[m]->count; k++) {
			*end = (struct part *)((char *)models[m]->parts + k * models[m]->size);
			add(*end);
			end = &(*end)->next;
		}
	for (int k = PLACE_FOOT + 1; k < PLACES; k++)
		fault_switch_add(&sockets[k].kind);
}

void parts_power(void)
{
	for (struct part *p = parts; p; p = p->next)
		if (p->model->power)
			p->model->power(p);
}

void parts_resume(void)
{
	for (struct part *p = parts; p; p = p->next) {
		if (p->model->resume)
			p->model->resume(p);
		if (p->sample_at > avr->cycle)
			part_sample_after(p, p->sample_at - avr->cycle);
	}
}
