/* SPDX-License-Identifier: GPL-3.0-or-later
 * LIS3MDL magnetometer on I2C at 0x1C [LIS3MDL data sheet]: a sub-address whose upper bit makes the addresses count up;
 * it measures at the rate, in the range and in the order of bytes that are set. The counts are the row's field, at 4
 * gauss. */
#include <math.h>
#include <string.h>

#include "parts/parts.h"

enum { WHO_AM_I = 0x0F, CTRL_REG1 = 0x20, CTRL_REG2, CTRL_REG3, CTRL_REG4, STATUS = 0x27, OUT, REGISTERS = 0x40 };
enum { READY = 0x08, SINGLE = 0x01, POWER_DOWN = 0x02, LOW_POWER = 0x20, FAST = 0x02, HIGH_BYTE_FIRST = 0x02 };
enum { WRONG_IDENTITY = OTHER_TWI_FAULTS, NEVER_READY, SATURATED };
#define IDENTITY 0x3D
#define OTHER_IDENTITY 0x40 /* a LIS2MDL */
#define FIRST_SAMPLE US(12500)
#define FULL_SCALE 32767

static struct register_file chips[] = {
	{ .twi = { .part = PART(lis3mdl, PLACE_COMPASS, "lis3mdl"), .address = 0x1C } },
};
static uint8_t registers[REGISTERS];
static avr_cycle_count_t ready_at;
static uint64_t measured; /* number of the newest measurement since then */
static bool ready;

static void set(void *self, uint8_t at, uint8_t value)
{
	if (at < CTRL_REG1 || at >= STATUS)
		return;
	if (at == CTRL_REG3 && (registers[at] & POWER_DOWN) && !(value & POWER_DOWN)) {
		ready_at = avr->cycle + FIRST_SAMPLE;
		measured = 0;
	}
	registers[at] = value;
}

static double hertz(void)
{
	static const double fast[4] = { 1000.0, 560.0, 300.0, 155.0 }; /* by the operative mode */
	uint8_t rate = registers[CTRL_REG1];

	if (registers[CTRL_REG3] & LOW_POWER)
		return 0.625;
	return rate & FAST ? fast[rate >> 5 & 3] : ldexp(0.625, rate >> 2 & 7);
}

static void sample(unsigned fault)
{
	double share = 1.0 / (1 + (registers[CTRL_REG2] >> 5 & 3)); /* of 4 gauss in the range */
	int first = registers[CTRL_REG4] & HIGH_BYTE_FIRST ? 1 : 0;

	for (int k = 0; k < 3; k++) {
		int counts = fault == SATURATED ? FULL_SCALE : (int)lround(input.field[k] * share);

		registers[OUT + 2 * k + first] = (uint8_t)counts;
		registers[OUT + 2 * k + 1 - first] = (uint8_t)((unsigned)counts >> 8);
	}
}

static uint8_t status(unsigned fault)
{
	bool on = !(registers[CTRL_REG3] & POWER_DOWN) && avr->cycle >= ready_at;
	uint64_t count = on ? 1 + (uint64_t)((double)(avr->cycle - ready_at) * hertz() / 16e6) : 0;

	if (count > 1 && (registers[CTRL_REG3] & SINGLE))
		count = 1;
	if (count && count != measured) {
		sample(fault);
		ready = true;
	}
	measured = count;
	return ready && fault != NEVER_READY ? READY : 0;
}

static int get(void *self, uint8_t at)
{
	unsigned fault = chips->part.fault.value;

	if (at == WHO_AM_I)
		return fault == WRONG_IDENTITY ? OTHER_IDENTITY : IDENTITY;
	if (at == STATUS)
		return status(fault);
	if (at == OUT + 5)
		ready = false;
	return registers[at];
}

static void power(void *self)
{
	memset(registers, 0, sizeof registers);
	registers[CTRL_REG1] = 0x10;
	registers[CTRL_REG3] = POWER_DOWN | SINGLE;
	ready = false;
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
