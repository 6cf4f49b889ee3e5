/* SPDX-License-Identifier: GPL-3.0-or-later
 * Three LSM6DSO on the chip selects of the ADIS16100 [LSM6DSO data sheet DS12140]: SPI mode 0 or 3, at most 10 MHz, the address first, then
 * bytes whose addresses count up. Gyros of 1000 deg/s give 0.035 deg/s per count, those of other ranges in proportion; accelerometers of 8 g
 * 0.244 mg.
 *
 * The self-test changes the rate by 150 to 700 deg/s at 2000 deg/s and by 20 to 80 at 250 [page 10]; between them in proportion to the range.
 *
 * A rate is ready 70 ms after the gyros are switched on, then at the output rate, here always 1.67 kHz: what is read is the row under way.
 * The axes are those that the extended rows have; a plain row has the rate about z only, and a part that lies still otherwise. */
#include <math.h>
#include <string.h>

#include "twin.h"

enum { INT2_CTRL = 0x0E, WHO_AM_I, CTRL1_XL, CTRL2_G, CTRL3_C, CTRL5_C = 0x14, CTRL8_XL = 0x17, STATUS = 0x1E, OUT_TEMP = 0x20, OUT_G = 0x22, OUT_A = 0x28, REGISTERS = 0x80 };
enum { RATE_READY = 2, FORCE_READY = 1 };
#define IDENTITY 0x6C
#define MAX_HERTZ 10000000u
#define RISE_NS 210u /* to 0.7 VDDIO, by 10 kohm and at most 50 pF behind the breakout's BSS138, computed */
#define BOOT US(10000)
#define GYROS_ON US(70000)
#define FASTEST_READY US(600)
#define FILTER_S 0.0032 /* 50 Hz */
#define FULL_SCALE 32767
#define VIBRATION_HERTZ 400.0
#define VIBRATION_COUNTS 8196.0 /* 2 g */

static struct imu {
	struct spi_device spi;
	const char *name;
	enum place place;
	enum fault { GOOD, ABSENT, ZEROS, WRONG_IDENTITY, NEVER_READY, STUCK, SATURATED, WEAK, VIBRATING, FAULTS } fault;
	uint8_t registers[REGISTERS], address, count, out[14];
	bool reading, garbled;
	avr_cycle_count_t up_at, rates_at, read_at;
	double excited; /* counts of 0.035 deg/s added by the self-test at the time `excited_at` */
	avr_cycle_count_t excited_at;
	int response;
	struct axes kept; /* of a part that is stuck */
} imus[3] = {
	{ .name = "imu_thigh", .place = PLACE_THIGH },
	{ .name = "imu_calf", .place = PLACE_CALF },
	{ .name = "imu_belt", .place = PLACE_BELT },
};
static const char *const fault_names[FAULTS] = {
	"ok", "absent", "zeros", "wrong_identity", "never_ready", "stuck", "saturated", "no_self_test", "vibrating",
};

static bool is_here(const struct imu *u)
{
	return kit_of_2026(u->place) && u->fault != ABSENT && avr->cycle >= u->up_at && !u->garbled;
}

static double full_scale_dps(const struct imu *u)
{
	static const double by_code[4] = { 250.0, 500.0, 1000.0, 2000.0 };

	return by_code[(u->registers[CTRL2_G] >> 2) & 3];
}

/* Counts of 0.035 deg/s that the self-test adds in the end: ST_G 01 of positive, 11 of negative sign. */
static double target(const struct imu *u)
{
	unsigned mode = (u->registers[CTRL5_C] >> 2) & 3;
	double response = u->fault == WEAK ? u->response * 0.05 : u->response;

	response *= full_scale_dps(u) / 2000.0;
	return mode == 1 ? response : mode == 3 ? -response : 0.0;
}

static double excitation(const struct imu *u)
{
	return target(u) + (u->excited - target(u)) * exp(-(double)(avr->cycle - u->excited_at) / 16e6 / FILTER_S);
}

static int limited(double value)
{
	return value > FULL_SCALE ? FULL_SCALE : value < -FULL_SCALE - 1 ? -FULL_SCALE - 1 : (int)lround(value);
}

static void put(struct imu *u, int word, int value)
{
	u->out[2 * word] = (uint8_t)value;
	u->out[2 * word + 1] = (uint8_t)((unsigned)value >> 8);
}

/* A vibration above the rate at which the part is polled, behind the low pass of the accelerometers: half the output rate of 1667 Hz, or with LPF2
 * its share by HPCF_XL [chapter 9, CTRL1_XL and CTRL8_XL; half the output rate from memory]. */
static double vibration(const struct imu *u)
{
	static const double shares[8] = { 4.0, 10.0, 20.0, 45.0, 100.0, 200.0, 400.0, 800.0 };
	double cut = 1667.0 / (u->registers[CTRL1_XL] & 2 ? shares[u->registers[CTRL8_XL] >> 5] : 2.0), r = VIBRATION_HERTZ / cut;

	if (u->fault != VIBRATING)
		return 0.0;
	return VIBRATION_COUNTS / sqrt(1.0 + r * r * r * r) * sin(6.283185307 * VIBRATION_HERTZ * (double)avr->cycle / 16e6);
}

static void sample(struct imu *u)
{
	const struct axes *a = u->fault == STUCK ? &u->kept : &motion[u - imus];

	put(u, 0, limited((row.temperature / 20.0 - 25.0) * 256.0));
	for (int k = 0; k < 3; k++) {
		double rate = a->rate[k] + excitation(u);

		put(u, 1 + k, u->registers[CTRL2_G] ? limited(u->fault == SATURATED ? 1e6 : rate * 1000.0 / full_scale_dps(u)) : 0);
		put(u, 4 + k, u->registers[CTRL1_XL] ? limited(a->force[k] + vibration(u)) : 0);
	}
}

static uint8_t status(const struct imu *u)
{
	bool rates = u->registers[CTRL2_G] >> 4 && avr->cycle >= u->rates_at && avr->cycle >= u->read_at + FASTEST_READY;

	return u->fault == NEVER_READY ? 0 : (uint8_t)((rates ? RATE_READY : 0) | (u->registers[CTRL1_XL] >> 4 ? FORCE_READY : 0));
}

static uint8_t value_at(struct imu *u, uint8_t at)
{
	if (at == WHO_AM_I)
		return u->fault == WRONG_IDENTITY ? 0x69 : IDENTITY; /* an LSM6DS3 */
	if (at == STATUS) {
		uint8_t flags = status(u);

		sample(u);
		return flags;
	}
	if (at < OUT_TEMP || at >= OUT_TEMP + sizeof u->out)
		return at < REGISTERS ? u->registers[at] : 0;
	if (at == OUT_G + 5)
		u->read_at = avr->cycle;
	return u->out[at - OUT_TEMP];
}

static void write_register(struct imu *u, uint8_t at, uint8_t value)
{
	if (at >= REGISTERS || at == WHO_AM_I || at >= STATUS)
		return;
	if (at == CTRL2_G && !(u->registers[at] >> 4) && value >> 4)
		u->rates_at = avr->cycle + GYROS_ON;
	if (at == CTRL5_C || at == CTRL2_G) {
		u->excited = excitation(u);
		u->excited_at = avr->cycle;
	}
	u->registers[at] = value;
}

static void on_select(struct spi_device *self, bool on)
{
	struct imu *u = (struct imu *)self;

	u->count = 0;
	u->garbled = spi_hertz() > MAX_HERTZ || spi_outruns(RISE_NS);
	if (on && u->garbled && kit_of_2026(u->place))
		bench_trace("%s clock too fast", u->name);
}

static int on_exchange(struct spi_device *self, uint8_t byte)
{
	struct imu *u = (struct imu *)self;
	uint8_t out = spi_at_rising_edges(byte);

	if (u->fault == ZEROS && kit_of_2026(u->place))
		return 0;
	if (!is_here(u))
		return SPI_OPEN;
	if (u->count++ == 0) {
		u->reading = out & 0x80;
		u->address = out & 0x7F;
		return SPI_OPEN;
	}
	u->count = 1;
	if (u->reading)
		return spi_answer(value_at(u, u->address++));
	if (spi_mode() != 0 && spi_mode() != 3)
		bench_trace("%s misreads a frame: 0x%02x to register 0x%02x", u->name, out, u->address);
	write_register(u, u->address++, out);
	return SPI_OPEN;
}

static void restart(struct imu *u)
{
	memset(u->registers, 0, sizeof u->registers);
	u->registers[CTRL3_C] = 0x04;
	if (!u->response && kit_of_2026(u->place)) /* drawn when it is first plugged in: a board of the papers is the same with and without this model */
		u->response = 4600 + (int)random_below(15000); /* 161 to 686 deg/s */
	u->up_at = avr->cycle + BOOT;
	u->excited = 0.0;
	u->read_at = 0;
}

void lsm6dso_power(void)
{
	for (int k = 0; k < 3; k++) {
		struct imu *u = &imus[k];

		if (!u->spi.select) {
			u->spi = (struct spi_device){ 'B', (uint8_t)(4 + k), on_select, on_exchange, false, NULL };
			spi_add(&u->spi);
		}
		restart(u);
	}
}

unsigned lsm6dso_plugged(void)
{
	unsigned count = 0;

	for (int k = 0; k < 3; k++)
		count += kit_of_2026(imus[k].place) && imus[k].fault != ABSENT;
	return count;
}

bool lsm6dso_fault(const char *name, const char *value)
{
	for (int k = 0; k < 3; k++)
		for (int f = 0; !strcmp(name, imus[k].name) && f < FAULTS; f++)
			if (!strcmp(value, fault_names[f])) {
				if (imus[k].fault == ABSENT && f != ABSENT)
					restart(&imus[k]); /* plugged in again */
				imus[k].kept = motion[k];
				imus[k].fault = (enum fault)f;
				return true;
			}
	return false;
}
