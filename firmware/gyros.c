/* SPDX-License-Identifier: MIT */
#include "gyros.h"
#include "adis16100.h"     /* driver */
#include "configuration.h" /* rate, enabled gyros */
#include "icm20649.h"      /* identity of a foot's part */
#include "link.h"          /* sending the messages */
#include "lsm6dso.h"       /* driver */
#include "parts.h"         /* what was found */
#include "selftest.h"      /* receives the rates while a self-test runs, and says how to excite the parts */
#include "status.h"        /* error counters */

#define START_UP_TICKS (20u * TICKS_PER_MS)   /* from a configuration to the first sample */
/* of parts that got their power together with the board: 10 ms [LSM6DSO], 100 ms [ICM-20649] */
#define POWER_UP_TICKS (100u * TICKS_PER_MS)
#define FIRST_HEALTH_TICKS (100u * TICKS_PER_MS) /* an LSM6DSO has neither rate nor temperature before */
#define WARM_UP_SAMPLES 16u                 /* 80 ms: an LSM6DSO has rates after 70 ms */
/* samples in a row without a value after which the part is sought again: 0.2 s */
#define MISSES_MAX 40u
#define PROOFS 5u                           /* answers before a part is believed */
#define TEMPERATURE_STEP_MAX 8              /* counts, 1.2 degC: between two readings one after the other, assumed */

/* Of a gyro; the enums of chips, devices and sensors' bits have the three in the same order. */
static enum chip chip_of(uint8_t gyro)
{
	return (enum chip)(CHIP_THIGH + gyro);
}

static enum device device_of(uint8_t gyro)
{
	return (enum device)(DEVICE_THIGH + gyro);
}

static bool is_read(uint8_t gyro)
{
	return configuration_reads((uint8_t)(SENSORS_THIGH << gyro));
}

static struct {
	enum { UNKNOWN, ADIS16100, LSM6DSO } kind; /* the part that has proven itself */
	uint8_t fault;    /* of an unknown one */
	uint8_t misses;   /* samples in a row without a value */
	int16_t warmth;   /* newest temperature of an LSM6DSO */
	int16_t axes[LSM6DSO_AXES]; /* of the newest sample instant, MSG_MOTION_INVALID without one */
} gyros[GYROS] = { { .misses = MISSES_MAX }, { .misses = MISSES_MAX }, { .misses = MISSES_MAX } };

static uint8_t warming; /* samples until an LSM6DSO that was switched on has rates: a self-test waits */
static enum excitation excitation; /* in force */
/* Times in ticks of the board's clock. */
static uint32_t due;        /* next sample */
static uint32_t health_due; /* next `gyro_health` messages */
static uint32_t period;     /* between samples */

void gyros_start(uint32_t now)
{
	static bool again;
	due = now + (again ? START_UP_TICKS : POWER_UP_TICKS);
	again = true;
	health_due = due + FIRST_HEALTH_TICKS;
	period = TICKS_PER_S / configuration.gyro_rate_hz;
}

/* A line that is held low reads as a rate of zero, and an idle one as anything: an ADIS16100 must name the channel of
 * its temperature, and give about the same value, five times. */
static bool is_adis16100(enum chip chip, uint8_t *fault)
{
	int16_t first = adis16100_temperature(chip, fault);
	for (uint8_t n = 1; n < PROOFS && *fault == FAULT_NONE; n++) {
		int16_t step = (int16_t)(adis16100_temperature(chip, fault) - first);
		if (*fault == FAULT_NONE && (step > TEMPERATURE_STEP_MAX || step < -TEMPERATURE_STEP_MAX))
			*fault = FAULT_WRONG_CHANNEL;
	}
	return *fault == FAULT_NONE;
}

/* Seeks a part. Those with an identity come first, since frames for an ADIS16100 write to their registers. */
static void seek(uint8_t gyro)
{
	enum chip chip = chip_of(gyro);
	gyros[gyro].misses = 0;
	gyros[gyro].kind = UNKNOWN;
	gyros[gyro].fault = FAULT_NO_ANSWER;
	if (lsm6dso_answers(chip)) {
		gyros[gyro].kind = LSM6DSO;
		parts_found((uint8_t)device_of(gyro), PART_LSM6DSO, LSM6DSO_IDENTITY);
		lsm6dso_start(chip);
		warming = WARM_UP_SAMPLES;
	} else if (!icm20649_answers(chip) && is_adis16100(chip, &gyros[gyro].fault)) {
		gyros[gyro].kind = ADIS16100;
		parts_found((uint8_t)device_of(gyro), PART_ADIS16100, 0);
	} else if (parts_in((uint8_t)device_of(gyro)) != PART_ADIS16100) {
		gyros[gyro].fault = FAULT_NO_ANSWER; /* what was read is an idle line's */
	}
}

/* Seeks parts that are not known, and makes each ADIS16100 convert: the value of its previous conversion is a whole
 * period old. */
static void prepare(void)
{
	for (uint8_t k = 0; k < GYROS; k++) {
		if (gyros[k].misses >= MISSES_MAX)
			seek(k);
		if (gyros[k].kind == ADIS16100)
			adis16100_convert(chip_of(k));
	}
}

static void note(uint8_t gyro, uint8_t fault)
{
	if (fault == FAULT_NONE) {
		gyros[gyro].misses = 0;
		status_ok(device_of(gyro));
	} else {
		gyros[gyro].misses++;
		status_failed(device_of(gyro), fault);
	}
}

/* 0.035 deg/s, or the double while they are excited -> 0.2439 deg/s, rounded. */
static int16_t in_units_of_gyros(int16_t rate)
{
	int32_t scaled = (int32_t)rate * 18809;
	return (int16_t)(((excitation != EXCITE_NONE ? 2 * scaled : scaled) + 65536) >> 17);
}

static void set_axes(uint8_t gyro, const int16_t *values)
{
	for (uint8_t k = 0; k < LSM6DSO_AXES; k++)
		gyros[gyro].axes[k] = values ? values[k] : MSG_MOTION_INVALID;
}

/* An LSM6DSO without a sample in its first moments has not failed. */
static int16_t read_six_axes(uint8_t gyro)
{
	struct lsm6dso_sample s;
	uint8_t fault = lsm6dso_read(chip_of(gyro), &s);
	if (fault == FAULT_NEVER_READY && ++gyros[gyro].misses < MISSES_MAX)
		return MSG_GYROS_INVALID;
	note(gyro, fault);
	if (fault != FAULT_NONE)
		return MSG_GYROS_INVALID;
	gyros[gyro].warmth = s.temperature;
	set_axes(gyro, s.axes);
	return in_units_of_gyros(s.axes[LSM6DSO_Z]);
}

static int16_t rate(uint8_t gyro)
{
	uint8_t fault;
	set_axes(gyro, 0);
	if (!is_read(gyro))
		return MSG_GYROS_INVALID;
	if (gyros[gyro].kind == LSM6DSO)
		return read_six_axes(gyro);
	int16_t counts = MSG_GYROS_INVALID;
	fault = gyros[gyro].fault;
	if (gyros[gyro].kind == ADIS16100)
		counts = adis16100_rate(chip_of(gyro), &fault);
	note(gyro, fault);
	return counts;
}

static void send_motion(uint32_t ticks)
{
	const int16_t *t = gyros[GYRO_THIGH].axes, *c = gyros[GYRO_CALF].axes, *b = gyros[GYRO_BELT].axes;
	struct msg_motion m = {
		ticks, t[0], t[1], t[2], t[3], t[4], t[5],
		c[0], c[1], c[2], c[3], c[4], c[5], b[0], b[1], b[2], b[3], b[4], b[5],
	};
	link_send(MSG_MOTION, msg_pack_motion(link_body(), &m));
}

/* Also one that has failed since. */
static bool any_six_axes(void)
{
	return parts_in(DEVICE_THIGH) == PART_LSM6DSO || parts_in(DEVICE_CALF) == PART_LSM6DSO ||
	       parts_in(DEVICE_BELT) == PART_LSM6DSO;
}

/* Applies the self-test's excitation when it has changed. */
static void excite(void)
{
	if (excitation == selftest_excitation())
		return;
	excitation = selftest_excitation();
	spi_excite_gyros(excitation);
	for (uint8_t k = 0; k < GYROS; k++)
		if (gyros[k].kind == LSM6DSO)
			lsm6dso_excite(chip_of(k), excitation);
}

static void sample(void)
{
	excite();
	prepare();
	struct msg_gyros m = { clock_now(), MSG_GYROS_INVALID, MSG_GYROS_INVALID, MSG_GYROS_INVALID };
	const int16_t rates[GYROS] = { rate(GYRO_THIGH), rate(GYRO_CALF), rate(GYRO_BELT) };
	if (warming)
		warming--;
	if (selftest_running()) {
		if (!warming)
			selftest_add_rates(rates);
	} else {
		m.thigh = rates[GYRO_THIGH];
		m.calf = rates[GYRO_CALF];
		m.belt = rates[GYRO_BELT];
		if (any_six_axes() && link_wants(REPORTS_MOTION))
			send_motion(m.ticks);
	}
	link_send(MSG_GYROS, msg_pack_gyros(link_body(), &m));
}

/* Counts of 0.1453 degC; of an LSM6DSO from counts of 1/256 degC, 6.88 / 256 as 55 / 2048. */
static int16_t temperature(uint8_t gyro)
{
	uint8_t fault;
	if (gyros[gyro].kind == UNKNOWN || (gyros[gyro].kind == LSM6DSO && gyros[gyro].misses))
		return MSG_GYRO_HEALTH_INVALID;
	if (gyros[gyro].kind == LSM6DSO)
		return (int16_t)((int32_t)gyros[gyro].warmth * 55 / 2048);
	int16_t counts = adis16100_temperature(chip_of(gyro), &fault);
	note(gyro, fault);
	if (fault != FAULT_NONE)
		/* its rates may be those of a line that is held low: it must prove itself again */
		gyros[gyro].misses = MISSES_MAX;
	return counts;
}

/* Settings may have arrived with a wrong bit, or been lost: they are read back, and written anew. */
static void check_settings(uint8_t gyro)
{
	if (gyros[gyro].kind != LSM6DSO || gyros[gyro].misses || excitation != EXCITE_NONE || lsm6dso_is_set(chip_of(gyro)))
		return;
	lsm6dso_start(chip_of(gyro));
	status_failed(device_of(gyro), FAULT_BAD_VALUE);
}

static void report_health(void)
{
	for (uint8_t k = 0; k < GYROS; k++) {
		if (!is_read(k))
			continue;
		check_settings(k);
		const struct selftest_result *test = selftest_result(k);
		int16_t counts = temperature(k);
		struct msg_gyro_health m = { clock_now(), k, counts, test->outcome, test->response[0], test->response[1] };
		link_send(MSG_GYRO_HEALTH, msg_pack_gyro_health(link_body(), &m));
	}
}

uint32_t gyros_run(uint32_t now)
{
	uint32_t step = selftest_running() ? TICKS_PER_S / GYROS_RATE_MAX_HZ : period;
	if (!ticks_reached(now, due))
		return due;
	if (configuration_reads(SENSORS_THIGH | SENSORS_CALF | SENSORS_BELT))
		sample();
	if (ticks_reached(now, health_due)) {
		report_health();
		health_due = now + TICKS_PER_S;
	}
	due += step;
	if (ticks_reached(now, due)) /* late by more than one step: skip samples instead of sending a burst */
		due = now + step;
	return due;
}
