/* SPDX-License-Identifier: MIT */
#include "supply.h"
#include "board.h"    /* adc_take, restart_note_sag */
#include "messages.h" /* MSG_BOARD_HEALTH_INVALID */

/* The converter returns 1024 * reference / supply: the reading rises when the supply falls. */
#define REFERENCE_MV UINT32_C(1100) /* off by up to 9 %, but constant for one chip [data sheet, 29.3] */
#define FULL_SCALE UINT32_C(1024)
#define WARM_UP 32u    /* first readings, dropped: the reference needs 0.07 ms */
#define SAG_PERCENT 8u /* 0.4 V below the highest voltage since the start; less may be a loaded USB port */

static uint16_t newest, greatest; /* readings; greatest: since supply_take; 0: none */
static uint16_t best;             /* least reading since the start: of the highest voltage */
static uint8_t dropped;

void supply_run(void)
{
	uint16_t reading;
	if (!adc_take(&reading))
		return;
	if (dropped < WARM_UP) {
		dropped++;
		return;
	}
	newest = reading;
	if (reading > greatest)
		greatest = reading;
	if (!best || reading < best)
		best = reading;
	restart_note_sag(reading > best + best * SAG_PERCENT / 100u);
}

static uint16_t millivolts(uint16_t reading)
{
	if (!reading)
		return MSG_BOARD_HEALTH_INVALID;
	return (uint16_t)(REFERENCE_MV * FULL_SCALE / reading);
}

void supply_take(uint16_t *newest_mv, uint16_t *least_mv)
{
	*newest_mv = millivolts(newest);
	*least_mv = millivolts(greatest);
	greatest = newest;
}
