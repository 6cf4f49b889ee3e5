/* SPDX-License-Identifier: MIT */
#include "bus.h"
#include "board.h" /* ticks */

#define QUIET_TICKS (5u * TICKS_PER_MS / 4u) /* the longest transfer but a trigger takes 1.0 ms */

static struct {
	bool planned;
	uint32_t due;
} triggers[2];

void bus_plan_trigger(uint8_t side, bool planned, uint32_t due)
{
	triggers[side].planned = planned;
	triggers[side].due = due;
}

bool bus_is_quiet(uint32_t now)
{
	for (uint8_t side = 0; side < 2; side++)
		if (triggers[side].planned && ticks_reached(now + QUIET_TICKS, triggers[side].due))
			return false;
	return true;
}
