/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which part is plugged in in each place: that of the papers, that of the kit of 2026, none, on a foot board, or a MaxSonar. A part that is plugged
 * in gets its power anew. */
#include <string.h>

#include "twin.h"

enum { OF_PAPERS, OF_2026, EMPTY, MAXSONAR, KINDS };

static void ranger_power(void)
{
	pulse_power();
	maxsonar_power();
}

static struct socket {
	const char *place;
	const char *parts[KINDS];
	void (*power)(void);
	int part;
} sockets[PLACES] = {
	[PLACE_RANGER_LEFT] = { "part_ranger_left", { "srf02", "pulse", NULL, "maxsonar" }, ranger_power, OF_PAPERS },
	[PLACE_RANGER_RIGHT] = { "part_ranger_right", { "srf02", "pulse", NULL, "maxsonar" }, ranger_power, OF_PAPERS },
	[PLACE_COMPASS] = { "part_compass", { "cmps10", "lis3mdl" }, lis3mdl_power, OF_PAPERS },
	[PLACE_THIGH] = { "part_thigh", { "adis16100", "lsm6dso" }, lsm6dso_power, OF_PAPERS },
	[PLACE_CALF] = { "part_calf", { "adis16100", "lsm6dso" }, lsm6dso_power, OF_PAPERS },
	[PLACE_BELT] = { "part_belt", { "adis16100", "lsm6dso" }, lsm6dso_power, OF_PAPERS },
	[PLACE_PRESSURE] = { "part_pressure", { "scp1000", "bmp390" }, bmp390_power, OF_PAPERS },
};
static bool foot; /* a foot board */

bool kit_of_papers(enum place place)
{
	return sockets[place].part == OF_PAPERS;
}

bool kit_of_2026(enum place place)
{
	return sockets[place].part == OF_2026;
}

bool kit_has_maxsonar(enum place place)
{
	return sockets[place].part == MAXSONAR;
}

bool kit_has_foot(void)
{
	return foot;
}

static void plug(struct socket *s, int part)
{
	s->part = part;
	s->power();
}

static void plug_all(int part)
{
	drive_pin('D', 4, false);
	foot = part == EMPTY;
	for (int k = 0; k < PLACES; k++)
		plug(&sockets[k], part);
	icm20649_power();
}

bool kit_fault(const char *name, const char *value)
{
	static const char *const kits[] = { "papers", "2026", "foot" };

	for (int k = 0; !strcmp(name, "kit") && k <= EMPTY; k++)
		if (!strcmp(value, kits[k])) {
			plug_all(k);
			return true;
		}
	for (int k = 0; k < PLACES; k++)
		for (int part = 0; !strcmp(name, sockets[k].place) && part < KINDS; part++)
			if (sockets[k].parts[part] && !strcmp(value, sockets[k].parts[part])) {
				plug(&sockets[k], part);
				return true;
			}
	return false;
}
