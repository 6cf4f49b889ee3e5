/* SPDX-License-Identifier: GPL-3.0-or-later
 * LIS3MDL magnetometer on I2C at 0x1C [LIS3MDL data sheet]: a sub-address whose upper bit makes the addresses count up; in continuous mode
 * it measures at 80 Hz. The counts are the row's field. */
#include <string.h>

#include "parts/parts.h"

enum { WHO_AM_I = 0x0F, CTRL_REG1 = 0x20, CTRL_REG3 = 0x22, STATUS = 0x27, OUT = 0x28, REGISTERS = 0x40 };
enum { READY = 0x08, POWER_DOWN = 0x03 };
enum { WRONG_IDENTITY = OTHER_TWI_FAULTS, NEVER_READY, SATURATED };
#define IDENTITY 0x3D
#define OTHER_IDENTITY 0x40 /* a LIS2MDL */
#define FIRST_SAMPLE US(12500)
#define FULL_SCALE 32767

static struct register_file chips[] = { { .twi = { .part = PART(lis3mdl, PLACE_COMPASS, "lis3mdl"), .address = 0x1C } } };
static uint8_t registers[REGISTERS];
static avr_cycle_count_t ready_at;

static void set(void *self, uint8_t at, uint8_t value)
{
	if (at < CTRL_REG1 || at >= STATUS)
		return;
	if (at == CTRL_REG3 && (registers[at] & POWER_DOWN) && !(value & POWER_DOWN))
		ready_at = avr->cycle + FIRST_SAMPLE;
	registers[at] = value;
}

static void sample(unsigned fault)
{
	for (int k = 0; k < 3; k++) {
		int counts = fault == SATURATED ? FULL_SCALE : input.field[k];

		registers[OUT + 2 * k] = (uint8_t)counts;
		registers[OUT + 2 * k + 1] = (uint8_t)((unsigned)counts >> 8);
	}
}

static int get(void *self, uint8_t at)
{
	unsigned fault = chips->part.fault.value;

	if (at == WHO_AM_I)
		return fault == WRONG_IDENTITY ? OTHER_IDENTITY : IDENTITY;
	if (at != STATUS)
		return registers[at];
	sample(fault);
	return !(registers[CTRL_REG3] & POWER_DOWN) && avr->cycle >= ready_at && fault != NEVER_READY ? READY : 0;
}

static void power(void *self)
{
	memset(registers, 0, sizeof registers);
	registers[CTRL_REG3] = POWER_DOWN;
}

const struct model lis3mdl = {
	.kind = OF_2026,
	.faults = "ok absent nack stretch wrong_identity never_ready saturated",
	PARTS(chips),
	.power = power,
	.changed = part_returned,
	.write = registers_write,
	.read = registers_read,
	.get = get,
	.set = set,
	.address_mask = REGISTERS - 1,
	.fault_stretch_us = 100,
};
