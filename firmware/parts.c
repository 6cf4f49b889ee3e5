/* SPDX-License-Identifier: MIT */
#include "parts.h"
#include <stddef.h> /* offsetof */
#include "board.h"  /* clock_now */
#include "link.h"   /* sending the message */

#define FOUND offsetof(struct msg_parts, part_ranger_left)
#define IDENTITIES offsetof(struct msg_parts, identity_ranger_left)
_Static_assert(offsetof(struct msg_parts, part_foot) == FOUND + PLACE_FOOT, "in the order of the places");

static struct msg_parts parts;

void parts_found(uint8_t place, uint8_t part, uint8_t identity)
{
	uint8_t *fields = (uint8_t *)&parts;
	fields[FOUND + place] = part;
	fields[IDENTITIES + place] = identity;
}

uint8_t parts_in(uint8_t place)
{
	return ((const uint8_t *)&parts)[FOUND + place];
}

void parts_set_wiring(uint8_t wiring)
{
	parts.wiring = wiring;
}

void parts_send(void)
{
	parts.ticks = clock_now();
	link_send(MSG_PARTS, msg_pack_parts(link_body(), &parts));
}
