/* Self-test of the three gyros: their inputs ST1 and ST2 push the vibrating mass one way, then the other; the rate must follow. */
#ifndef ECHOSTEP_SELFTEST_H
#define ECHOSTEP_SELFTEST_H

#include <stdbool.h>
#include <stdint.h>

#define GYROS 3u

/* How a gyro's last test ended. */
struct verdict {
	uint8_t outcome;                /* SELF_TEST_* */
	int16_t response[2];            /* to ST1 and ST2, counts; INT16_MIN: not known */
};

/* Starts a test, or starts it anew. */
void selftest_begin(void);

bool selftest_running(void);

/* One sample of all three gyros while it runs, every 5 ms; INT16_MIN: no answer. The last one ends the test. */
void selftest_take(const int16_t rate[GYROS]);

const struct verdict *selftest_verdict(uint8_t gyro);

#endif
