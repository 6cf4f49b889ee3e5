/* SPDX-License-Identifier: GPL-3.0-or-later
 * Three LSM6DSO on the chip selects of the ADIS16100 [LSM6DSO data sheet DS12140]: SPI mode 0 or 3, at most 10 MHz. Gyros of 1000 deg/s give
 * 0.035 deg/s per count, those of other ranges in proportion; accelerometers of 8 g 0.244 mg.
 *
 * The self-test changes the rate by 150 to 700 deg/s at 2000 deg/s and by 20 to 80 at 250 [page 10]; between them in proportion to the range.
 *
 * A rate is ready 70 ms after the gyros are switched on, then at the output rate, here always 1.67 kHz: what is read is the row under way.
 * The axes are those that the extended rows have; a plain row has the rate about z only, and a part that lies still otherwise. */
#include <math.h>
#include <string.h>

#include "parts/parts.h"

enum { WHO_AM_I = 0x0F, CTRL1_XL, CTRL2_G, CTRL3_C, CTRL5_C = 0x14, CTRL8_XL = 0x17, CTRL9_XL = 0x18, STATUS = 0x1E, OUT_TEMP = 0x20, OUT_G = 0x22, OUT_A = 0x28, REGISTERS = 0x80 };
enum { RATE_READY = 2, FORCE_READY = 1 };
enum { ZEROS = OTHER_FAULTS, WRONG_IDENTITY, NEVER_READY, STUCK, SATURATED, WEAK, VIBRATING, I3C };
#define IDENTITY 0x6C
#define OTHER_IDENTITY 0x69 /* an LSM6DS3 */
#define BOOT US(10000)
#define GYROS_ON US(70000)
#define FASTEST_READY US(600)
#define FILTER_S 0.0032 /* 50 Hz */
#define FULL_SCALE 32767
#define VIBRATION_HERTZ 400.0
#define VIBRATION_COUNTS 8196.0 /* 2 g */

static struct imu {
	struct register_file file;
	uint8_t registers[REGISTERS];
	avr_cycle_count_t rates_at, read_at;
	double excited; /* counts of 0.035 deg/s added by the self-test at the time `excited_at` */
	avr_cycle_count_t excited_at;
	int response;
	bool confused; /* by frames for others while the processor restarted, for I3C was on [STMicroelectronics/stm32-lsm6dso issue 1] */
	struct axes kept; /* of a part that is stuck */
} imus[3] = {
	{ .file.spi = { .part = PART(lsm6dso, PLACE_THIGH, "imu_thigh"), .port = 'B', .pin = 4 } },
	{ .file.spi = { .part = PART(lsm6dso, PLACE_CALF, "imu_calf"), .port = 'B', .pin = 5 } },
	{ .file.spi = { .part = PART(lsm6dso, PLACE_BELT, "imu_belt"), .port = 'B', .pin = 6 } },
};

static double full_scale_dps(const struct imu *u)
{
	static const double by_code[4] = { 250.0, 500.0, 1000.0, 2000.0 };

	return by_code[(u->registers[CTRL2_G] >> 2) & 3];
}

/* Counts of 0.035 deg/s that the self-test adds in the end: ST_G 01 of positive, 11 of negative sign. */
static double target(const struct imu *u)
{
	unsigned mode = (u->registers[CTRL5_C] >> 2) & 3;
	double response = u->file.part.fault.value == WEAK ? u->response * 0.05 : u->response;

	response *= full_scale_dps(u) / 2000.0;
	return mode == 1 ? response : mode == 3 ? -response : 0.0;
}

static double excitation(const struct imu *u)
{
	return target(u) + (u->excited - target(u)) * exp(-(double)(avr->cycle - u->excited_at) / 16e6 / FILTER_S);
}

/* A vibration above the rate at which the part is polled, behind the low pass of the accelerometers: half the output rate of 1667 Hz, or with LPF2
 * its share by HPCF_XL [chapter 9, CTRL1_XL and CTRL8_XL; half the output rate from memory]. */
static double vibration(const struct imu *u)
{
	static const double shares[8] = { 4.0, 10.0, 20.0, 45.0, 100.0, 200.0, 400.0, 800.0 };
	double cut = 1667.0 / (u->registers[CTRL1_XL] & 2 ? shares[u->registers[CTRL8_XL] >> 5] : 2.0), r = VIBRATION_HERTZ / cut;

	if (u->file.part.fault.value != VIBRATING)
		return 0.0;
	return VIBRATION_COUNTS / sqrt(1.0 + r * r * r * r) * sin(6.283185307 * VIBRATION_HERTZ * (double)avr->cycle / 16e6);
}

static void put(struct imu *u, int at, double value)
{
	long counts = value > FULL_SCALE ? FULL_SCALE : value < -FULL_SCALE - 1 ? -FULL_SCALE - 1 : lround(value);

	u->registers[at] = (uint8_t)counts;
	u->registers[at + 1] = (uint8_t)((unsigned long)counts >> 8);
}

static void sample(struct imu *u)
{
	unsigned fault = u->file.part.fault.value;
	const struct axes *a = fault == STUCK ? &u->kept : &input.motion[u - imus];

	put(u, OUT_TEMP, (input.row.temperature / 20.0 - 25.0) * 256.0);
	for (int k = 0; k < 3; k++) {
		double rate = fault == SATURATED ? 1e6 : (a->rate[k] + excitation(u)) * 1000.0 / full_scale_dps(u);

		put(u, OUT_G + 2 * k, u->registers[CTRL2_G] ? rate : 0.0);
		put(u, OUT_A + 2 * k, u->registers[CTRL1_XL] ? a->force[k] + vibration(u) : 0.0);
	}
}

static uint8_t status(const struct imu *u)
{
	bool rates = u->registers[CTRL2_G] >> 4 && avr->cycle >= u->rates_at && avr->cycle >= u->read_at + FASTEST_READY;

	return u->file.part.fault.value == NEVER_READY ? 0 : (uint8_t)((rates ? RATE_READY : 0) | (u->registers[CTRL1_XL] >> 4 ? FORCE_READY : 0));
}

static int get(void *self, uint8_t at)
{
	struct imu *u = self;

	if (at == WHO_AM_I && u->confused)
		return 0;
	if (at == WHO_AM_I)
		return u->file.part.fault.value == WRONG_IDENTITY ? OTHER_IDENTITY : IDENTITY;
	if (at == STATUS) {
		sample(u);
		return status(u);
	}
	if (at == OUT_G + 5)
		u->read_at = avr->cycle;
	return u->registers[at];
}

static void set(void *self, uint8_t at, uint8_t value)
{
	struct imu *u = self;

	if (at == WHO_AM_I || at >= STATUS)
		return;
	if (at == CTRL2_G && !(u->registers[at] >> 4) && value >> 4)
		u->rates_at = avr->cycle + GYROS_ON;
	if (at == CTRL5_C || at == CTRL2_G) {
		u->excited = excitation(u);
		u->excited_at = avr->cycle;
	}
	u->registers[at] = value;
}

static void power(void *self)
{
	struct imu *u = self;

	memset(u->registers, 0, STATUS);
	u->registers[CTRL3_C] = 0x04;
	if (!u->response && part_is_plugged(self)) /* drawn when it is first plugged in: a board of the papers is the same with and without this model */
		u->response = 4600 + (int)random_below(15000); /* 161 to 686 deg/s */
	u->file.up_at = avr->cycle + BOOT;
	u->excited = 0.0;
	u->confused = false;
	u->read_at = 0;
}

static void resume(void *self)
{
	struct imu *u = self;

	u->confused = u->file.part.fault.value == I3C && !(u->registers[CTRL9_XL] & 2);
}

static void changed(void *self, unsigned before)
{
	struct imu *u = self;

	part_returned(self, before);
	u->kept = input.motion[u - imus];
}

const struct model lsm6dso = {
	.kind = OF_2026,
	.faults = "ok absent zeros wrong_identity never_ready stuck saturated no_self_test vibrating i3c",
	PARTS(imus),
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
