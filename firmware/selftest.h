/* SPDX-License-Identifier: MIT */
/* Self-test of the three gyros: inputs ST1 and ST2 deflect the vibrating mass, first one way, then the other; the rate
 * must follow. */
#ifndef ECHOSTEP_SELFTEST_H
#define ECHOSTEP_SELFTEST_H

#include <stdbool.h>
#include <stdint.h>
#include "board.h" /* enum excitation */
#include "gyros.h" /* GYROS */

/* Result of one gyro's last test. */
struct selftest_result {
	uint8_t outcome;     /* SELF_TEST_* */
	int16_t response[2]; /* to ST1 and ST2, counts; MSG_GYRO_HEALTH_INVALID: not measured */
};

/* Starts a test; a running one starts again. */
void selftest_begin(void);

bool selftest_running(void);

/* What the gyros' inputs must be now. */
enum excitation selftest_excitation(void);

/* Adds one sample of the three gyros (counts; MSG_GYROS_INVALID: no answer) to the running test, every 5 ms. The last
 * one ends it. */
void selftest_add_rates(const int16_t rate[GYROS]);

const struct selftest_result *selftest_result(uint8_t gyro);

#endif
