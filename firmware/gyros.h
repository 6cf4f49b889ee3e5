/* SPDX-License-Identifier: MIT */
/* Analog Devices ADIS16100: the three rate gyros of thigh, calf and belt. One `gyros` message per sample instant, one `gyro_health`
 * message per gyro and second. */
#ifndef ECHOSTEP_GYROS_H
#define ECHOSTEP_GYROS_H

#include <stdint.h>

#define GYROS 3u
#define GYROS_RATE_MIN_HZ 10u
#define GYROS_RATE_MAX_HZ 200u

/* Applies the configured rate; the first sample is due at once. */
void gyros_start(uint32_t now);

/* Samples when a sample is due (0.1 ms); returns the time of the next call. */
uint32_t gyros_run(uint32_t now);

#endif
