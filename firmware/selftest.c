/* SPDX-License-Identifier: MIT */
#include "selftest.h"
#include "messages.h" /* SELF_TEST_* */
#include "parts.h"    /* whose limits apply */

/* Four parts, 0.72 s in all: at rest, ST1, ST2, at rest again. Each part waits 100 ms [ST's example for the LSM6DSO;
 * the ADIS16100's filter of 40 Hz needs less], then averages 16 samples. */
#define SETTLE_SAMPLES 20u
#define WINDOW_SAMPLES 16u
#define PART_SAMPLES (SETTLE_SAMPLES + WINDOW_SAMPLES)

/* Response in counts: 150 to 450 mV [ADXRS300 data sheet; typical 270 mV] through the ADIS16100's converter, 4096
 * counts for 5 V, with a margin of about 2 counts at the lower end and 7 at the upper one. */
#define RESPONSE_MIN 121
#define RESPONSE_MAX 376
#define SYMMETRY_MAX 80 /* counts: a larger sum of the two responses means that the rate itself changed */
/* The same of an LSM6DSO: 150 to 700 deg/s at a range of 2000 [DS12140, table 2, page 10]; a tenth of asymmetry,
 * assumed. */
#define LSM6DSO_RESPONSE_MIN 615
#define LSM6DSO_RESPONSE_MAX 2870
#define LSM6DSO_SYMMETRY_MAX 300
#define STILL_MAX 30 /* counts, 7 deg/s: a wider spread within a window is motion */

enum part { REST, DOWN, UP, RECOVERY, IDLE }; /* DOWN: ST1 lowers the rate; UP: ST2 raises it */

static enum part part = IDLE;
static uint8_t samples; /* of this part */

#define NOT_RUN { SELF_TEST_NOT_RUN, { MSG_GYRO_HEALTH_INVALID, MSG_GYRO_HEALTH_INVALID } }

static struct gyro {
	int32_t sum;
	int16_t least, greatest; /* of the window */
	int16_t rest;            /* mean rate without excitation */
	bool moved, answered;
	struct selftest_result result;
} gyros[GYROS] = {
	{ .result = NOT_RUN },
	{ .result = NOT_RUN },
	{ .result = NOT_RUN },
};

static void clear_window(struct gyro *g)
{
	g->sum = 0;
	g->least = INT16_MAX;
	g->greatest = INT16_MIN;
}

static void enter(enum part next)
{
	part = next;
	samples = 0;
	for (uint8_t k = 0; k < GYROS; k++)
		clear_window(&gyros[k]);
}

void selftest_begin(void)
{
	for (uint8_t k = 0; k < GYROS; k++) {
		struct gyro *g = &gyros[k];
		g->moved = false;
		g->answered = true;
		g->result.outcome = SELF_TEST_RUNNING;
		g->result.response[0] = g->result.response[1] = MSG_GYRO_HEALTH_INVALID;
	}
	enter(REST);
}

enum excitation selftest_excitation(void)
{
	return part == DOWN ? EXCITE_ST1 : part == UP ? EXCITE_ST2 : EXCITE_NONE;
}

bool selftest_running(void)
{
	return part != IDLE;
}

static void add(struct gyro *g, int16_t rate)
{
	if (rate == MSG_GYROS_INVALID) {
		g->answered = false;
		return;
	}
	g->sum += rate;
	if (rate < g->least)
		g->least = rate;
	if (rate > g->greatest)
		g->greatest = rate;
}

static void close_window(struct gyro *g)
{
	int16_t mean = (int16_t)(g->sum / (int16_t)WINDOW_SAMPLES);
	if (!g->answered)
		return;
	if (g->greatest - g->least > STILL_MAX)
		g->moved = true;
	if (part == REST)
		g->rest = mean;
	else if (part != RECOVERY)
		g->result.response[part - DOWN] = (int16_t)(mean - g->rest);
}

static bool is_proper(int16_t response, bool six_axes)
{
	if (six_axes)
		return response >= LSM6DSO_RESPONSE_MIN && response <= LSM6DSO_RESPONSE_MAX;
	return response >= RESPONSE_MIN && response <= RESPONSE_MAX;
}

static uint8_t outcome_of(const struct gyro *g)
{
	bool six_axes = parts_in((uint8_t)(DEVICE_THIGH + (g - gyros))) == PART_LSM6DSO;
	int16_t down = g->result.response[0], up = g->result.response[1];
	int16_t difference = (int16_t)(up + down), most = six_axes ? LSM6DSO_SYMMETRY_MAX : SYMMETRY_MAX;
	if (!g->answered)
		return SELF_TEST_NO_ANSWER;
	if (g->moved || difference > most || difference < -most)
		return SELF_TEST_MOVED;
	return is_proper((int16_t)-down, six_axes) && is_proper(up, six_axes) ? SELF_TEST_PASSED : SELF_TEST_FAILED;
}

void selftest_add_rates(const int16_t rate[GYROS])
{
	bool settled = ++samples > SETTLE_SAMPLES, last = samples >= PART_SAMPLES;
	for (uint8_t k = 0; k < GYROS && settled; k++)
		add(&gyros[k], rate[k]);
	if (!last)
		return;
	for (uint8_t k = 0; k < GYROS; k++) {
		close_window(&gyros[k]);
		if (part == RECOVERY)
			gyros[k].result.outcome = outcome_of(&gyros[k]);
	}
	enter((enum part)(part + 1));
}

const struct selftest_result *selftest_result(uint8_t gyro)
{
	return &gyros[gyro].result;
}
