/* SPDX-License-Identifier: GPL-3.0-or-later
 * BMP390 barometer on SPI [BST-BMP390-DS002]: modes 0 and 3, at most 10 MHz; a read returns a dummy byte first, and a
 * frame writes one byte.
 *
 * In normal mode it measures at 200 Hz / 2^ODR; a measurement sets its bit in STATUS, and reading the pressure clears
 * it. The counts are those from which the data sheet's compensation (8.5, 8.6) returns the row's pressure and
 * temperature: found by bisection. */
#include <math.h>
#include <string.h>

#include "parts/parts.h"

enum { CHIP_ID = 0x00, REV_ID, ERR_REG, STATUS, DATA, IF_CONF = 0x1A, PWR_CTRL, OSR, ODR, CONFIG = 0x1F };
enum { CHECKSUM = 0x30, COEFFICIENTS, CMD = 0x7E, REGISTERS = 0x80 };
enum { READY_FOR_COMMANDS = 0x10, PRESSURE_READY = 0x20, TEMPERATURE_READY = 0x40, NORMAL = 0x30, BOTH = 3 };
enum { THREE_WIRES = 1, SOFT_RESET = 0xB6 };
enum { ZEROS = OTHER_FAULTS, WRONG_IDENTITY, EMPTY, STUCK_READY, NEVER_READY };
#define IDENTITY 0x60
#define OTHER_IDENTITY 0x58 /* a BMP280 */
#define START_UP US(2000)
#define FASTEST US(5000)
#define COEFFICIENTS_SIZE 21
#define FULL_SCALE 0xFFFFFFu

static struct register_file chips[] = {
	{ .spi = { .part = PART(bmp390, PLACE_PRESSURE, "bmp390"), .port = 'D', .pin = 7 } },
};
static uint8_t registers[REGISTERS];
static double low_pass[2]; /* counts of pressure and temperature; 0: none yet */

/* PAR_T1 ... PAR_P11 of a typical part, as integers, and their powers of two [8.4]. */
enum { T1, T2, T3, P1, P2, P3, P4, P5, P6, P7, P8, P9, P10, P11, PARAMETERS };
static struct parameter {
	int value, size, power;
	double offset;
} parameters[PARAMETERS] = {
	{ 28159, 2, 8, 0 }, { 18902, 2, -30, 0 }, { -10, 1, -48, 0 }, { 773, 2, -20, 16384 }, { -1377, 2, -29, 16384 },
	{ 35, 1, -32, 0 }, { 0, 1, -37, 0 }, { 25011, 2, 3, 0 }, { 30127, 2, -6, 0 }, { 3, 1, -8, 0 }, { -7, 1, -15, 0 },
	{ 16194, 2, -48, 0 }, { 6, 1, -48, 0 }, { -60, 1, -65, 0 },
};

static double par(int k)
{
	return ldexp(parameters[k].value - parameters[k].offset, parameters[k].power);
}

static double celsius_of(double raw, double unused)
{
	double d = raw - par(T1);

	return d * par(T2) + d * d * par(T3);
}

static double pascal_of(double raw, double t)
{
	double offset = par(P5) + par(P6) * t + par(P7) * t * t + par(P8) * t * t * t;
	double linear = raw * (par(P1) + par(P2) * t + par(P3) * t * t + par(P4) * t * t * t);

	return offset + linear + raw * raw * (par(P9) + par(P10) * t) + raw * raw * raw * par(P11);
}

/* Counts at which `of` takes this value; it rises or falls with the counts over their whole range. */
static uint32_t counts_at(double (*of)(double, double), double value, double t)
{
	uint32_t low = 0, high = FULL_SCALE;
	bool rises = of(FULL_SCALE, t) > of(0, t);

	while (low < high) {
		uint32_t middle = (low + high) / 2;

		if ((of(middle, t) < value) == rises)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

static void put24(uint8_t at, uint32_t value)
{
	for (int k = 0; k < 3; k++)
		registers[at + k] = (uint8_t)(value >> 8 * k);
}

/* Time that a measurement takes [3.9.2, from memory]. */
static unsigned conversion_us(void)
{
	unsigned pressure = 1u << (registers[OSR] & 7), temperature = 1u << (registers[OSR] >> 3 & 7);

	return 234 + 392 + 2020 * pressure + 163 + 2020 * temperature;
}

/* Of normal mode; 0: asleep, or a conversion would be longer than its period [3.9.2]. */
static avr_cycle_count_t period(void)
{
	avr_cycle_count_t cycles = FASTEST << registers[ODR];

	return (registers[PWR_CTRL] & NORMAL) == NORMAL && US(conversion_us()) < cycles ? cycles : 0;
}

/* The low pass begins with the first sample [4.3.21]. */
static uint32_t filtered(double *state, uint32_t raw)
{
	double coefficient = (1 << (registers[CONFIG] >> 1 & 7)) - 1;

	*state = *state > 0.0 ? *state + (raw - *state) / (coefficient + 1.0) : raw;
	return (uint32_t)lround(*state);
}

static avr_cycle_count_t sample(void *self)
{
	uint32_t raw = counts_at(celsius_of, input.row.temperature / 20.0, 0);

	raw = filtered(&low_pass[1], raw);
	put24(DATA, filtered(&low_pass[0], counts_at(pascal_of, input.row.pressure / 4.0, celsius_of(raw, 0))));
	put24(DATA + 3, raw);
	if ((registers[PWR_CTRL] & BOTH) == BOTH)
		registers[STATUS] |= PRESSURE_READY | TEMPERATURE_READY;
	return period();
}

/* As Bosch's example bmp3_selftest.c computes it. */
static uint8_t checksum(void)
{
	unsigned crc = 0xFF;

	for (int k = 0; k < 8 * COEFFICIENTS_SIZE; k++) {
		unsigned bit = (registers[COEFFICIENTS + k / 8] >> (7 - k % 8)) & 1;

		crc = (crc << 1 ^ ((crc >> 7 & 1) != bit ? 0x1D : 0)) & 0xFF;
	}
	return (uint8_t)~crc;
}

static void power(void *self)
{
	uint8_t *c = registers + COEFFICIENTS;

	memset(registers, 0, sizeof registers);
	registers[REV_ID] = 0x01;
	registers[STATUS] = READY_FOR_COMMANDS;
	registers[OSR] = 0x02;
	put24(DATA, 0x800000);
	put24(DATA + 3, 0x800000);
	for (int k = 0; k < PARAMETERS; k++)
		for (int byte = 0; byte < parameters[k].size; byte++)
			*c++ = (uint8_t)((unsigned)parameters[k].value >> 8 * byte);
	registers[CHECKSUM] = checksum();
	low_pass[0] = low_pass[1] = 0.0;
	part_sample_after(self, 0);
	chips->up_at = avr->cycle + START_UP;
}

static int get(void *self, uint8_t at)
{
	unsigned fault = chips->part.fault.value;
	uint8_t value = registers[at];

	if (fault == ZEROS)
		return 0;
	if (at == CHIP_ID)
		return fault == WRONG_IDENTITY ? OTHER_IDENTITY : IDENTITY;
	if (at >= COEFFICIENTS && at < COEFFICIENTS + COEFFICIENTS_SIZE && fault == EMPTY)
		return 0;
	if (at == STATUS)
		return fault == STUCK_READY ? value | PRESSURE_READY : fault == NEVER_READY ? value & ~PRESSURE_READY : value;
	if (at >= DATA && at < DATA + 3)
		registers[STATUS] &= (uint8_t)~PRESSURE_READY;
	return value;
}

static void set(void *self, uint8_t at, uint8_t value)
{
	if (chips->count > 2)
		return;
	if (at == CMD && value == SOFT_RESET)
		power(self);
	if (at < IF_CONF || at >= CHECKSUM) /* read only */
		return;
	registers[at] = value;
	if (at >= PWR_CTRL && at <= ODR)
		part_sample_after(self, period());
}

static int exchange(void *self, uint8_t sent)
{
	int answer = registers_exchange(self, sent);

	return (registers[IF_CONF] & THREE_WIRES) && chips->part.fault.value != ZEROS ? SPI_OPEN : answer;
}

const struct model bmp390 = {
	.kind = OF_2026,
	.faults = "ok absent zeros wrong_identity empty stuck_ready never_ready",
	PARTS(chips),
	.power = power,
	.changed = part_returned,
	.sample = sample,
	.select = registers_select,
	.exchange = exchange,
	.get = get,
	.set = set,
	.dummy_bytes = 1,
	.rise_ns = 410, /* to 0.8 VDDIO, by 10 kohm and at most 50 pF behind the breakout's BSS138, computed */
};
