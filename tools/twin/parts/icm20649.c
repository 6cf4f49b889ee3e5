/* SPDX-License-Identifier: GPL-3.0-or-later
 * ICM-20649 of a foot board, at the thigh's chip select (PB4), INT1 on PD4 [ICM-20649 data sheet DS-000192]: SPI mode 0
 * or 3, at most 7 MHz; four user banks. Rates of 4000 deg/s have 8.2 counts per deg/s, forces of 30 g 1024 per g; other
 * ranges are scaled from those. The low passes, of first order here, have the bandwidths that are set [tables 16 and
 * 18].
 *
 * The counts are those of the row's thigh, between this millisecond's and the one before, at the moment of the sample
 * by the part's own clock. No FIFO: the program reads the registers of the newest sample, and one that is not read in
 * time is overwritten. */
#include <math.h>
#include <string.h>

#include <simavr/sim_cycle_timers.h>

#include "parts/parts.h"

enum { WHO_AM_I = 0x00, PWR_MGMT_1 = 0x06, INT_ENABLE_1 = 0x11, INT_STATUS_1 = 0x1A, OUT = 0x2D, BANK_SEL = 0x7F };
enum { REGISTERS = 0x80, BANKS = 4 };
enum { GYRO_SMPLRT_DIV = 0x00, GYRO_CONFIG_1 = 0x01, ACCEL_SMPLRT_DIV_2 = 0x11, ACCEL_CONFIG = 0x14 }; /* of bank 2 */
enum { DEVICE_RESET = 0x80, SLEEP = 0x40, CLOCK = 7, CLOCK_STOPPED = 7, RAW_DATA_READY = 1, LOW_PASS = 1 };
enum { ZEROS = OTHER_FAULTS, WRONG_IDENTITY, NEVER_READY, STUCK_READY, STUCK, SATURATED };
#define IDENTITY 0xE1
#define OTHER_IDENTITY 0xEA /* an ICM-20948 */
#define START_UP US(11000)
#define GYROS_ON US(35000)
#define INT_PULSE US(50)
#define CYCLES_AT_1125_HZ 14222.2
#define OWN_CLOCK 0.01 /* largest error of it */
#define FULL_SCALE 32767
#define FULL_SCALE_30_G 30720

static struct register_file chips[] = {
	{ .spi = { .part = PART(icm20649, PLACE_FOOT, "icm20649"), .port = 'B', .pin = 4 } },
};
static uint8_t registers[BANKS][REGISTERS], out[14];
static uint8_t bank;
static bool sampling;
static double low_pass[6]; /* forces, rates, in counts */
static bool settled;       /* they have begun */
static unsigned since_forces; /* periods of 1125 Hz since the forces were measured */
static double own_clock; /* cycles of the processor for each of its own, drawn when it is first plugged in */

static unsigned fault(void)
{
	return chips->part.fault.value;
}

static void set_line(bool level)
{
	if (part_is_here(&chips->part))
		drive_pin('D', 4, level || fault() == STUCK_READY);
	else if (part_is_plugged(&chips->part))
		floating_pin('D', 4, true);
}

static int between(int16_t before, int16_t now)
{
	return (int)lround(before + (now - before) * clock_fraction());
}

static void put(int word, double value, int limit)
{
	int counts = value > limit ? limit : value < -limit ? -limit : (int)lround(value);

	out[2 * word] = (uint8_t)((unsigned)counts >> 8);
	out[2 * word + 1] = (uint8_t)counts;
}

/* Full scale of a configuration register: 0 is an eighth of 3. */
static double scale(uint8_t at)
{
	return (double)(8u >> ((registers[2][at] >> 1) & 3));
}

static avr_cycle_count_t period(void)
{
	return (avr_cycle_count_t)(CYCLES_AT_1125_HZ * own_clock * (1 + registers[2][GYRO_SMPLRT_DIV]));
}

/* The newest value's share in what the low pass gives. */
static double share(uint8_t at)
{
	static const double cuts[2][8] = {
		{ 196.6, 151.8, 119.5, 51.2, 23.9, 11.6, 5.7, 361.4 },
		{ 246.0, 246.0, 111.4, 50.4, 23.9, 11.5, 5.7, 473.0 },
	};
	uint8_t value = registers[2][at];
	double cut = cuts[at == ACCEL_CONFIG][value >> 3 & 7];

	return settled && (value & LOW_PASS) ? 1.0 - exp(-6.283185307 * cut * (double)period() / 16e6) : 1.0;
}

static void measure(int word, double value, uint8_t at, int limit)
{
	low_pass[word] += share(at) * (scale(at) * value - low_pass[word]);
	put(word, fault() == SATURATED ? 1e6 : low_pass[word], limit);
}

static void sample(void)
{
	int force_limit = registers[2][ACCEL_CONFIG] & 6 ? FULL_SCALE_30_G : FULL_SCALE;
	bool forces;

	since_forces += 1u + registers[2][GYRO_SMPLRT_DIV];
	forces = since_forces > registers[2][ACCEL_SMPLRT_DIV_2];
	for (int k = 0; k < 3; k++) {
		measure(3 + k, between(previous.motion[0].rate[k], input.motion[0].rate[k]), GYRO_CONFIG_1, FULL_SCALE);
		if (forces)
			measure(k, between(previous.motion[0].force[k], input.motion[0].force[k]), ACCEL_CONFIG, force_limit);
	}
	since_forces = forces ? 0 : since_forces;
	settled = true;
	put(6, (input.row.temperature / 20.0 - 21.0) * 333.87, FULL_SCALE);
}

static bool runs(void)
{
	return !(registers[0][PWR_MGMT_1] & SLEEP) && (registers[0][PWR_MGMT_1] & CLOCK) != CLOCK_STOPPED;
}

static avr_cycle_count_t line_falls(avr_t *a, avr_cycle_count_t when, void *param)
{
	set_line(false);
	return 0;
}

static avr_cycle_count_t next_sample(avr_t *a, avr_cycle_count_t when, void *param)
{
	bool shows = (registers[0][INT_ENABLE_1] & RAW_DATA_READY) && fault() != NEVER_READY && fault() != STUCK_READY;

	sampling = runs();
	if (!sampling)
		return 0;
	if (fault() != STUCK)
		sample();
	if (shows && registers_answer(chips)) {
		set_line(true);
		bench_trace("foot");
		avr_cycle_timer_register(a, INT_PULSE, line_falls, NULL);
	}
	return when + period();
}

static void restart(void)
{
	memset(registers, 0, sizeof registers);
	registers[0][PWR_MGMT_1] = SLEEP | 1;
	registers[2][GYRO_CONFIG_1] = registers[2][ACCEL_CONFIG] = 1;
	bank = 0;
	sampling = settled = false;
	avr_cycle_timer_cancel(avr, next_sample, NULL);
	chips->up_at = avr->cycle + START_UP;
}

static void set(void *self, uint8_t at, uint8_t value)
{
	if (at == BANK_SEL)
		bank = (value >> 4) & 3;
	else if (bank)
		registers[bank][at] = value;
	else if (at == PWR_MGMT_1 && (value & DEVICE_RESET))
		restart();
	else if (at != WHO_AM_I && at < INT_STATUS_1)
		registers[0][at] = value;
	if (!bank && at == PWR_MGMT_1 && runs() && !sampling) {
		sampling = true;
		avr_cycle_timer_register(avr, GYROS_ON, next_sample, NULL);
	}
}

static int get(void *self, uint8_t at)
{
	if (at == BANK_SEL)
		return bank << 4;
	if (bank == 0 && at == WHO_AM_I)
		return fault() == WRONG_IDENTITY ? OTHER_IDENTITY : IDENTITY;
	if (bank == 0 && at >= OUT && at < OUT + sizeof out)
		return out[at - OUT];
	return registers[bank][at];
}

static void power(void *self)
{
	if (own_clock == 0.0 && part_is_plugged(self))
		own_clock = 1.0 + OWN_CLOCK * ((int)random_below(2001) - 1000) / 1000.0;
	restart();
	set_line(false);
}

/* The part itself goes on. */
static void resume(void *self)
{
	set_line(false);
	if (sampling && part_is_plugged(self))
		avr_cycle_timer_register(avr, period(), next_sample, NULL);
}

static void changed(void *self, unsigned before)
{
	if (before == ABSENT || fault() == ABSENT)
		restart();
	set_line(false);
}

const struct model icm20649 = {
	.kind = OF_FOOT,
	.faults = "ok absent zeros wrong_identity never_ready stuck_ready stuck saturated",
	PARTS(chips),
	.power = power,
	.resume = resume,
	.changed = changed,
	.select = registers_select,
	.exchange = registers_exchange,
	.get = get,
	.set = set,
	.zeros = ZEROS,
	.rise_ns = 210, /* to 0.7 VDDIO, by 10 kohm and at most 50 pF behind the breakout's BSS138, computed */
};
