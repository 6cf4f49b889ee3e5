/* SPDX-License-Identifier: MIT */
#include "parts.h"
#include "board.h" /* clock_now */
#include "link.h"  /* sending the message */

#define PLACES (PLACE_FOOT + 1u)

static uint8_t found[PLACES];
static uint8_t identities[PLACES];
static uint8_t wiring;

void parts_found(uint8_t place, uint8_t part, uint8_t identity)
{
	found[place] = part;
	identities[place] = identity;
}

uint8_t parts_in(uint8_t place)
{
	return found[place];
}

void parts_set_wiring(uint8_t found_wiring)
{
	wiring = found_wiring;
}

void parts_send(void)
{
	struct msg_parts m = {
		.ticks = clock_now(),
		.part_ranger_left = found[DEVICE_RANGER_LEFT],
		.part_ranger_right = found[DEVICE_RANGER_RIGHT],
		.part_compass = found[DEVICE_COMPASS],
		.part_thigh = found[DEVICE_THIGH],
		.part_calf = found[DEVICE_CALF],
		.part_belt = found[DEVICE_BELT],
		.part_pressure = found[DEVICE_PRESSURE],
		.part_foot = found[PLACE_FOOT],
		.identity_ranger_left = identities[DEVICE_RANGER_LEFT],
		.identity_ranger_right = identities[DEVICE_RANGER_RIGHT],
		.identity_compass = identities[DEVICE_COMPASS],
		.identity_thigh = identities[DEVICE_THIGH],
		.identity_calf = identities[DEVICE_CALF],
		.identity_belt = identities[DEVICE_BELT],
		.identity_pressure = identities[DEVICE_PRESSURE],
		.identity_foot = identities[PLACE_FOOT],
		.wiring = wiring,
	};
	link_send(MSG_PARTS, msg_pack_parts(link_body(), &m));
}
