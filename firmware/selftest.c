#include "selftest.h"
#include "board.h"
#include "messages.h"

/* 0.48 s: at rest, ST1, ST2, at rest again; in each part 60 ms pass for the 40 Hz filter to settle, then 16 samples are averaged. */
#define SETTLE_SAMPLES 12u
#define WINDOW_SHIFT 4u
#define WINDOW_SAMPLES (1u << WINDOW_SHIFT)
#define PART_SAMPLES (SETTLE_SAMPLES + WINDOW_SAMPLES)

/* [ADXRS300 data sheet: 150, 270, 450 mV] through the ADIS16100's converter of 4096 counts for 5 V, a little widened. */
#define RESPONSE_MIN 121
#define RESPONSE_MAX 376
#define STILL_MAX 30     /* counts, 7 deg/s: a wider spread within a window is motion */
#define SYMMETRY_MAX 80  /* counts: responses that differ by more mean that the rate itself changed */

#define UNKNOWN INT16_MIN

enum part { REST, DOWN, UP, RECOVERY, IDLE };

static enum part part = IDLE;
static uint8_t taken; /* samples of this part */

static struct gyro {
	int32_t sum;
	int16_t least, greatest, rest;
	bool moved, answered;
	struct verdict verdict;
} gyros[GYROS] = {
	{ .verdict = { SELF_TEST_NOT_RUN, { UNKNOWN, UNKNOWN } } },
	{ .verdict = { SELF_TEST_NOT_RUN, { UNKNOWN, UNKNOWN } } },
	{ .verdict = { SELF_TEST_NOT_RUN, { UNKNOWN, UNKNOWN } } },
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
	taken = 0;
	for (uint8_t k = 0; k < GYROS; k++)
		clear_window(&gyros[k]);
	gyro_excite(next == DOWN ? EXCITE_ST1 : next == UP ? EXCITE_ST2 : EXCITE_NONE);
}

void selftest_begin(void)
{
	for (uint8_t k = 0; k < GYROS; k++) {
		struct gyro *g = &gyros[k];
		g->moved = false;
		g->answered = true;
		g->verdict.outcome = SELF_TEST_RUNNING;
		g->verdict.response[0] = g->verdict.response[1] = UNKNOWN;
	}
	enter(REST);
}

bool selftest_running(void)
{
	return part != IDLE;
}

static void add(struct gyro *g, int16_t rate)
{
	if (rate == UNKNOWN) {
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
		g->verdict.response[part - DOWN] = (int16_t)(mean - g->rest);
}

static bool proper(int16_t response)
{
	return response >= RESPONSE_MIN && response <= RESPONSE_MAX;
}

static uint8_t judge(const struct gyro *g)
{
	int16_t down = g->verdict.response[0], up = g->verdict.response[1];
	int16_t difference = (int16_t)(up + down);
	if (!g->answered)
		return SELF_TEST_NO_ANSWER;
	if (g->moved || difference > SYMMETRY_MAX || difference < -SYMMETRY_MAX)
		return SELF_TEST_MOVED;
	return proper((int16_t)-down) && proper(up) ? SELF_TEST_PASSED : SELF_TEST_FAILED;
}

void selftest_take(const int16_t rate[GYROS])
{
	bool settled = ++taken > SETTLE_SAMPLES, last = taken >= PART_SAMPLES;
	for (uint8_t k = 0; k < GYROS && settled; k++)
		add(&gyros[k], rate[k]);
	if (!last)
		return;
	for (uint8_t k = 0; k < GYROS; k++) {
		close_window(&gyros[k]);
		if (part == RECOVERY)
			gyros[k].verdict.outcome = judge(&gyros[k]);
	}
	enter((enum part)(part + 1));
}

const struct verdict *selftest_verdict(uint8_t gyro)
{
	return &gyros[gyro].verdict;
}
