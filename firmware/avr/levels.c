/* SPDX-License-Identifier: MIT */
/* Levels of inputs that belong to other files, for the report on the wiring. */
#include <avr/io.h> /* registers */
#include "shared.h"

uint8_t levels_read(void)
{
	uint8_t levels = 0;
	if (PINB & BIT(PB3))
		levels |= BIT(LEVEL_MISO);
	if (PIND & BIT(PD4))
		levels |= BIT(LEVEL_D4);
	if (PINC & BIT(PC7))
		levels |= BIT(LEVEL_D13);
	if (PIND & BIT(PD1))
		levels |= BIT(LEVEL_SDA);
	if (PIND & BIT(PD0))
		levels |= BIT(LEVEL_SCL);
	return levels;
}
