/* SPDX-License-Identifier: GPL-3.0-or-later
 * True time against the processor's cycles: its crystal is off, by an amount that varies with the temperature. */
#include <math.h>

#include "twin.h"

enum { EXACT, CRYSTAL, RESONATOR };
FAULT_SWITCH(crystal, "ok drift resonator", NULL, EXACT)

static double cycles = CYCLES_PER_MS; /* in the millisecond under way */
static double begin, end;             /* of it, in cycles */
static uint64_t begin_ns;

/* Parts per million by which the processor is fast. An AT cut follows a cubic in the temperature, within 10 ppm from
 * -10 to 60 degC; a ceramic resonator is two orders of magnitude worse [both: typical curves of makers' data
 * sheets]. */
static double fast_ppm(void)
{
	double t = input.row.temperature / 20.0 - 25.0;

	if (crystal.value == CRYSTAL)
		return 30.0 - 0.2 * t + 1.05e-4 * pow(t, 3.0);
	return crystal.value == RESONATOR ? 3000.0 - 1.0 * t * t : 0.0;
}

avr_cycle_count_t clock_next_millisecond(void)
{
	begin = end;
	begin_ns += begin > 0.0 ? 1000000u : 0u;
	cycles = CYCLES_PER_MS * (1.0 + 1e-6 * fast_ppm());
	end = begin + cycles;
	return (avr_cycle_count_t)end;
}

avr_cycle_count_t clock_cycles(unsigned us)
{
	return (avr_cycle_count_t)(us * cycles / 1000.0);
}

double clock_fraction(void)
{
	return ((double)avr->cycle - begin) / cycles;
}

uint64_t time_ns(void)
{
	double since = (double)avr->cycle - begin;

	return begin_ns + (uint64_t)(since * 1e6 / cycles);
}
