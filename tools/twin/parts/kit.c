/* SPDX-License-Identifier: GPL-3.0-or-later
 * All chips, their power and faults, and which one is plugged in in each place: that of the papers, that of the kit of 2026, none, on a foot
 * board, or a MaxSonar. A part that is plugged in gets its power anew, and so do the others of its model. */
#include <string.h>

#include "parts/parts.h"

static const struct model *const models[] = {
	&srf02, &adis16100, &scp1000, &compass, &bmp390, &lis3mdl, &lsm6dso, &pulse, &maxsonar, &icm20649,
};
static struct part *parts;

static struct socket {
	const char *name, *kinds;             /* of its switch, and its values */
	const struct model *models[2];        /* that get their power anew */
	enum kind kind;
} sockets[PLACES] = {
	[PLACE_FOOT] = { "", "", { &icm20649 }, OF_PAPERS },
	[PLACE_RANGER_LEFT] = { "part_ranger_left", "srf02 pulse maxsonar", { &pulse, &maxsonar }, OF_PAPERS },
	[PLACE_RANGER_RIGHT] = { "part_ranger_right", "srf02 pulse maxsonar", { &pulse, &maxsonar }, OF_PAPERS },
	[PLACE_COMPASS] = { "part_compass", "cmps10 lis3mdl", { &lis3mdl }, OF_PAPERS },
	[PLACE_THIGH] = { "part_thigh", "adis16100 lsm6dso", { &lsm6dso }, OF_PAPERS },
	[PLACE_CALF] = { "part_calf", "adis16100 lsm6dso", { &lsm6dso }, OF_PAPERS },
	[PLACE_BELT] = { "part_belt", "adis16100 lsm6dso", { &lsm6dso }, OF_PAPERS },
	[PLACE_PRESSURE] = { "part_pressure", "scp1000 bmp390", { &bmp390 }, OF_PAPERS },
};

bool place_has(enum place place, enum kind kind)
{
	return sockets[place].kind == kind;
}

bool part_is_plugged(const struct part *part)
{
	return place_has(part->place, part->model->kind);
}

bool part_is_here(const struct part *part)
{
	return part_is_plugged(part) && part->fault != ABSENT;
}

unsigned parts_here(const struct model *model)
{
	unsigned count = 0;

	for (const struct part *p = parts; p; p = p->next)
		count += p->model == model && part_is_here(p);
	return count;
}

void parts_init(void)
{
	struct part **end = &parts;

	for (size_t m = 0; m < sizeof models / sizeof *models; m++)
		for (size_t k = 0; k < models[m]->count; k++) {
			*end = (struct part *)((char *)models[m]->parts + k * models[m]->size);
			models[m]->wire(*end);
			end = &(*end)->next;
		}
}

static void power(const struct model *model)
{
	for (struct part *p = parts; p; p = p->next)
		if (p->model == model && model->power)
			model->power(p);
}

void parts_power(void)
{
	for (size_t m = 0; m < sizeof models / sizeof *models; m++)
		power(models[m]);
}

void parts_resume(void)
{
	for (struct part *p = parts; p; p = p->next)
		if (p->model->resume)
			p->model->resume(p);
}

static void plug(struct socket *s, enum kind kind)
{
	s->kind = kind;
	for (int k = 0; k < 2 && s->models[k]; k++)
		power(s->models[k]);
}

void kit_plug(unsigned choice)
{
	static const enum kind kinds[] = { OF_PAPERS, OF_2026, OF_FOOT };

	drive_pin('D', 4, false);
	for (int k = 0; k < PLACES; k++)
		plug(&sockets[k], kinds[choice]);
}

bool kit_fault(const char *name, const char *value)
{
	for (int k = 0; k < PLACES; k++) {
		int kind = strcmp(name, sockets[k].name) ? -1 : choice_of(sockets[k].kinds, value);

		if (kind >= 0) {
			plug(&sockets[k], (enum kind)kind);
			return true;
		}
	}
	return false;
}

void part_returned(struct part *part, unsigned before)
{
	if (before == ABSENT)
		part->model->power(part);
}

bool part_fault(const char *name, const char *value)
{
	for (struct part *p = parts; p; p = p->next) {
		int fault = strcmp(name, p->name) ? -1 : choice_of(p->model->faults, value);
		unsigned before = p->fault;

		if (fault < 0)
			continue;
		p->fault = (unsigned)fault;
		if (p->model->changed)
			p->model->changed(p, before);
		return true;
	}
	return false;
}
