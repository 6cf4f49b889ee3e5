/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which part is plugged in in each place: that of the papers, or that of the kit of 2026. A part that is plugged in gets its power anew. */
#include <string.h>

#include "twin.h"

static struct socket {
	const char *place;
	const char *of_papers, *of_2026;
	void (*power)(void);
	bool is_2026;
} sockets[PLACES] = {
	[PLACE_RANGER_LEFT] = { "part_ranger_left", "srf02", "pulse", pulse_power, false },
	[PLACE_RANGER_RIGHT] = { "part_ranger_right", "srf02", "pulse", pulse_power, false },
	[PLACE_COMPASS] = { "part_compass", "cmps10", "lis3mdl", lis3mdl_power, false },
	[PLACE_THIGH] = { "part_thigh", "adis16100", "lsm6dso", lsm6dso_power, false },
	[PLACE_CALF] = { "part_calf", "adis16100", "lsm6dso", lsm6dso_power, false },
	[PLACE_BELT] = { "part_belt", "adis16100", "lsm6dso", lsm6dso_power, false },
	[PLACE_PRESSURE] = { "part_pressure", "scp1000", "bmp390", bmp390_power, false },
};

bool kit_of_2026(enum place place)
{
	return sockets[place].is_2026;
}

static void plug(struct socket *s, bool is_2026)
{
	s->is_2026 = is_2026;
	s->power();
}

bool kit_fault(const char *name, const char *value)
{
	bool papers = !strcmp(value, "papers"), modern = !strcmp(value, "2026");

	if (!strcmp(name, "kit") && (papers || modern)) {
		for (int k = 0; k < PLACES; k++)
			plug(&sockets[k], modern);
		return true;
	}
	for (int k = 0; k < PLACES; k++) {
		struct socket *s = &sockets[k];

		if (strcmp(name, s->place) || (strcmp(value, s->of_papers) && strcmp(value, s->of_2026)))
			continue;
		plug(s, !strcmp(value, s->of_2026));
		return true;
	}
	return false;
}
