/* SPDX-License-Identifier: GPL-3.0-or-later
 * Supply voltage: the brown-out detector, what low voltages do, and the converter's reading of the reference. */
#include <stdlib.h>
#include <string.h>

#include "twin.h"

#define REFERENCE_MV 1100
#define REFERENCE_SPREAD_MV 33 /* 3 %, from chip to chip; the data sheet allows 9 % */
#define MEMORY_MV 1300         /* below it, memory is lost and the next reset is one of power-on */
#define CHIPS_MV 3000          /* below it, the sensors start anew */
#define RELIABLE_MV 3600       /* below it, a processor at 16 MHz hangs; an example of what may happen below the specified 4500 */
#define BROWN_OUT_HYSTERESIS_MV 50
enum { BROWN_OUT = 4 }; /* in MCUSR */

static int supply_mv = 5000, brown_out_mv = 2600; /* the fuse of the boards as sold */
static bool in_brown_out, memory_lost, chips_down;

/* The converter measures the reference against the supply; simavr knows the reference only as 1100 mV. */
static void apply_supply(void)
{
	int spread = (int)(random_state % (2 * REFERENCE_SPREAD_MV + 1)) - REFERENCE_SPREAD_MV;
	static int reference_mv;

	if (!reference_mv)
		reference_mv = REFERENCE_MV + spread;
	avr->vcc = avr->avcc = (uint32_t)(supply_mv * REFERENCE_MV / reference_mv);
}

bool supply_fault(const char *value)
{
	char *end;
	long mv = strtol(value, &end, 10);

	if (end == value || *end || mv < 0 || mv > 6000)
		return false;
	supply_mv = (int)mv;
	memory_lost |= mv < MEMORY_MV;
	chips_down |= mv < CHIPS_MV;
	bench_trace("supply %ld", mv);
	if (mv < brown_out_mv || mv < MEMORY_MV) {
		in_brown_out = true;
		usb_host_unplug();
	} else if (in_brown_out && mv >= brown_out_mv + BROWN_OUT_HYSTERESIS_MV) {
		in_brown_out = false;
		board_reset(BROWN_OUT);
	}
	apply_supply();
	return true;
}

bool supply_fuse(const char *value)
{
	static const char *const levels[] = { "0", "2600", "4300" };

	for (unsigned k = 0; k < sizeof levels / sizeof *levels; k++)
		if (!strcmp(value, levels[k])) {
			brown_out_mv = atoi(value);
			return true;
		}
	return false;
}

bool supply_in_brown_out(void)
{
	return in_brown_out;
}

bool supply_is_unreliable(void)
{
	return supply_mv < RELIABLE_MV;
}

bool supply_took_memory(void)
{
	bool lost = memory_lost;

	memory_lost = false;
	return lost;
}

bool supply_took_chips(void)
{
	bool down = chips_down;

	chips_down = false;
	return down;
}

void supply_init(void)
{
	apply_supply();
}
