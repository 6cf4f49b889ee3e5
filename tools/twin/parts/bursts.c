/* SPDX-License-Identifier: GPL-3.0-or-later
 * The last bursts of a ranger, for the other one hears them too. */
#include "twin.h"

void bursts_add(struct bursts *own, avr_cycle_count_t at, uint16_t cross_us)
{
	own->last[own->count++ % BURSTS] = (struct burst){ at, cross_us };
}

uint32_t bursts_first_echo(const struct bursts *others, avr_cycle_count_t began, uint16_t own_us, uint32_t least_us, uint32_t window_us)
{
	int64_t none = (int64_t)window_us + 1, first = own_us >= least_us && own_us <= window_us ? own_us : none;

	for (int k = 0; k < BURSTS; k++) {
		const struct burst *b = &others->last[k];
		int64_t us = ((int64_t)b->at - (int64_t)began) / 16 + b->cross_us;

		if (b->cross_us && us >= least_us && us < first)
			first = us;
	}
	return first == none ? 0 : (uint32_t)first;
}
