/* SPDX-License-Identifier: GPL-3.0-or-later
 * Three LSM6DSO on the chip selects of the ADIS16100 [LSM6DSO data sheet DS12140]: SPI mode 0 or 3, at most 10 MHz.
 * Gyros of 1000 deg/s give 0.035 deg/s per count, those of other ranges in proportion; accelerometers of 8 g 0.244 mg.
 *
 * The self-test changes the rate by 150 to 700 deg/s at 2000 deg/s and by 20 to 80 at 250 [page 10]; between them in
 * proportion to the range.
 *
 * A rate is ready 70 ms after the gyros are switched on. Both sensors measure at their output rates; what is read is
 * the row under way when the first STATUS after a measurement is read. The axes are those that the extended rows have;
 * a plain row has the rate about z only, and a part that lies still otherwise. */
#include <math.h>
#include <string.h>

#include "parts/parts.h"

enum { WHO_AM_I = 0x0F, CTRL1_XL, CTRL2_G, CTRL3_C, CTRL4_C, CTRL5_C, CTRL6_C, CTRL8_XL = 0x17, CTRL9_XL };
enum { STATUS = 0x1E, RESERVED, OUT_TEMP, REGISTERS = 0x80 };
enum { ADDRESSES_COUNT_UP = 4, THREE_WIRES = 8, GYROS_SLEEP = 0x40, LPF1 = 2, I3C_OFF = 2 };
enum { RATES, FORCES, SENSORS };
static const struct {
	uint8_t control, out, ready; /* its control register, its first output, its bit of STATUS */
} sensors[SENSORS] = { { CTRL2_G, 0x22, 2 }, { CTRL1_XL, 0x28, 1 } };
enum { ZEROS = OTHER_FAULTS, WRONG_IDENTITY, NEVER_READY, STUCK, SATURATED, WEAK, VIBRATING, I3C };
#define IDENTITY 0x6C
#define OTHER_IDENTITY 0x69 /* an LSM6DS3 */
#define CONFUSING 90 /* bytes for others while I3C is on, after which the identity reads 0; assumed */
#define BOOT US(10000)
#define GYROS_ON US(70000)
#define SLOWEST_HERTZ 13.02 /* 1667 / 128 */
#define FILTER_S 0.0032 /* 50 Hz */
#define FULL_SCALE 32767
#define VIBRATION_HERTZ 400.0
#define VIBRATION_COUNTS 8196.0 /* 2 g */
#define TREMBLE_COUNTS 1429.0 /* 50 deg/s, with the vibration */

FAULT_SWITCH(imu_reserved, "<=255", NULL, 0) /* what register 0x1F reads, of which the data sheet says nothing */

static struct imu {
	struct register_file file;
	uint8_t registers[REGISTERS];
	avr_cycle_count_t on_at[SENSORS];
	uint64_t measured[SENSORS]; /* number of the newest measurement since then */
	uint8_t ready;              /* bits of STATUS */
	double excited; /* counts of 0.035 deg/s added by the self-test at the time `excited_at` */
	avr_cycle_count_t excited_at;
	int response;
	unsigned overheard; /* such bytes [STMicroelectronics/stm32-lsm6dso, issue 1] */
	struct axes kept; /* of a part that is stuck */
} imus[3] = {
	{ .file.spi = { .part = PART(lsm6dso, PLACE_THIGH, "imu_thigh"), .port = 'B', .pin = 4 } },
	{ .file.spi = { .part = PART(lsm6dso, PLACE_CALF, "imu_calf"), .port = 'B', .pin = 5 } },
	{ .file.spi = { .part = PART(lsm6dso, PLACE_BELT, "imu_belt"), .port = 'B', .pin = 6 } },
};

static double full_scale_dps(const struct imu *u)
{
	return u->registers[CTRL2_G] & 2 ? 125.0 : ldexp(250.0, (u->registers[CTRL2_G] >> 2) & 3);
}

static double full_scale_g(const struct imu *u)
{
	static const double by_code[4] = { 2.0, 16.0, 4.0, 8.0 };

	return by_code[(u->registers[CTRL1_XL] >> 2) & 3];
}

static double hertz(const struct imu *u, int sensor)
{
	bool asleep = sensor == RATES && (u->registers[CTRL4_C] & GYROS_SLEEP);
	int code = u->registers[sensors[sensor].control] >> 4;

	return asleep || code == 0 ? 0.0 : ldexp(SLOWEST_HERTZ, code - 1);
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

/* Low pass: of the accelerometers half the output rate, or with LPF2 its share by HPCF_XL; of the gyros LPF1 by FTYPE,
 * at 1.67 kHz [chapter 9, CTRL1_XL and CTRL8_XL, CTRL6_C; half the output rate and the gyros' from memory]. */
static double cut_hertz(const struct imu *u, int sensor)
{
	static const double shares[8] = { 4.0, 10.0, 20.0, 45.0, 100.0, 200.0, 400.0, 800.0 };
	static const double by_type[8] = { 274.0, 212.0, 150.0, 390.0, 93.0, 49.0, 24.6, 12.4 };

	if (sensor == RATES)
		return u->registers[CTRL4_C] & LPF1 ? by_type[u->registers[CTRL6_C] & 7] : hertz(u, sensor) / 2.0;
	return hertz(u, sensor) / (u->registers[CTRL1_XL] & 2 ? shares[u->registers[CTRL8_XL] >> 5] : 2.0);
}

/* A vibration above the rate at which the part is polled, behind the low pass. */
static double vibration(const struct imu *u, int sensor)
{
	double r = VIBRATION_HERTZ / cut_hertz(u, sensor), counts = sensor == RATES ? TREMBLE_COUNTS : VIBRATION_COUNTS;

	if (u->file.part.fault.value != VIBRATING)
		return 0.0;
	return counts / sqrt(1.0 + r * r * r * r) * sin(6.283185307 * VIBRATION_HERTZ * (double)avr->cycle / 16e6);
}

static void put(struct imu *u, int at, double value)
{
	long counts = value > FULL_SCALE ? FULL_SCALE : value < -FULL_SCALE - 1 ? -FULL_SCALE - 1 : lround(value);

	u->registers[at] = (uint8_t)counts;
	u->registers[at + 1] = (uint8_t)((unsigned long)counts >> 8);
}

static void measure(struct imu *u, int sensor)
{
	unsigned fault = u->file.part.fault.value;
	const struct axes *a = fault == STUCK ? &u->kept : &input.motion[u - imus];

	put(u, OUT_TEMP, (input.row.temperature / 20.0 - 25.0) * 256.0);
	for (int k = 0; k < 3; k++) {
		double rate = (a->rate[k] + excitation(u) + vibration(u, RATES)) * 1000.0 / full_scale_dps(u);
		double force = (a->force[k] + vibration(u, FORCES)) * 8.0 / full_scale_g(u);

		put(u, sensors[sensor].out + 2 * k, sensor == FORCES ? force : fault == SATURATED ? 1e6 : rate);
	}
}

static uint8_t status(struct imu *u)
{
	for (int k = 0; k < SENSORS; k++) {
		bool on = hertz(u, k) > 0.0 && avr->cycle >= u->on_at[k];
		uint64_t count = on ? 1 + (uint64_t)((double)(avr->cycle - u->on_at[k]) * hertz(u, k) / 16e6) : 0;

		if (on && count != u->measured[k]) {
			measure(u, k);
			u->ready |= sensors[k].ready;
		}
		u->measured[k] = count;
	}
	return u->file.part.fault.value == NEVER_READY ? 0 : u->ready;
}

static int get(void *self, uint8_t at)
{
	struct imu *u = self;

	if (at == WHO_AM_I && u->overheard >= (u->file.part.fault.value == I3C ? 1 : CONFUSING))
		return 0;
	if (at == WHO_AM_I)
		return u->file.part.fault.value == WRONG_IDENTITY ? OTHER_IDENTITY : IDENTITY;
	if (at == STATUS)
		return status(u);
	if (at == RESERVED)
		return (int)imu_reserved.value;
	for (int k = 0; k < SENSORS; k++)
		if (at == sensors[k].out + 5)
			u->ready &= (uint8_t)~sensors[k].ready;
	return u->registers[at];
}

static void set(void *self, uint8_t at, uint8_t value)
{
	struct imu *u = self;

	if (at == WHO_AM_I || at >= STATUS)
		return;
	for (int k = 0; k < SENSORS; k++)
		if (at == sensors[k].control && !(u->registers[at] >> 4) && value >> 4)
			u->on_at[k] = avr->cycle + (k == RATES ? GYROS_ON : 0);
	if (at == CTRL5_C || at == CTRL2_G) {
		u->excited = excitation(u);
		u->excited_at = avr->cycle;
	}
	u->registers[at] = value;
	if (at == CTRL9_XL && (value & I3C_OFF))
		u->overheard = 0;
}

static void overhear(void *self)
{
	struct imu *u = self;

	u->overheard += !(u->registers[CTRL9_XL] & I3C_OFF);
}

/* Without counting addresses a frame is of one register. */
static int exchange(void *self, uint8_t sent)
{
	struct imu *u = self;
	uint8_t at = u->file.address;
	bool first = u->file.count == 0;
	int answer = registers_exchange(self, sent);

	if (!first && !(u->registers[CTRL3_C] & ADDRESSES_COUNT_UP))
		u->file.address = at;
	return (u->registers[CTRL3_C] & THREE_WIRES) && u->file.part.fault.value != ZEROS ? SPI_OPEN : answer;
}

static void power(void *self)
{
	struct imu *u = self;

	memset(u->registers, 0, STATUS);
	u->registers[CTRL3_C] = ADDRESSES_COUNT_UP;
	u->registers[CTRL9_XL] = 0xE0;
	/* drawn when it is first plugged in: a board of the papers is the same with and without this model */
	if (!u->response && part_is_plugged(self))
		u->response = 4600 + (int)random_below(15000); /* 161 to 686 deg/s */
	u->file.up_at = avr->cycle + BOOT;
	u->excited = 0.0;
	u->overheard = u->ready = 0;
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
	.changed = changed,
	.select = registers_select,
	.exchange = exchange,
	.overhear = overhear,
	.get = get,
	.set = set,
	.zeros = ZEROS,
	.rise_ns = 210, /* to 0.7 VDDIO, by 10 kohm and at most 50 pF behind the breakout's BSS138, computed */
};
