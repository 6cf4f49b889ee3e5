/* SPDX-License-Identifier: MIT */
#include "electrical.h"
#include <string.h> /* memset */
#include "board.h"  /* levels_read */
#include "link.h"   /* sending the message */

static struct {
	uint8_t readings;
	uint8_t ones[LEVELS];
} counts;

void electrical_run(void)
{
	if (counts.readings == UINT8_MAX)
		return;
	counts.readings++;
	uint8_t levels = levels_read();
	for (uint8_t k = 0; k < LEVELS; k++, levels >>= 1)
		counts.ones[k] = (uint8_t)(counts.ones[k] + (levels & 1u));
}

void electrical_send(void)
{
	const uint8_t *n = counts.ones;
	struct msg_electrical m = {
		clock_now(), counts.readings, n[LEVEL_MISO], n[LEVEL_D4], n[LEVEL_D13], n[LEVEL_SDA], n[LEVEL_SCL],
	};
	link_send(MSG_ELECTRICAL, msg_pack_electrical(link_body(), &m));
	memset(&counts, 0, sizeof counts);
}
