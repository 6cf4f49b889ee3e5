/* SPDX-License-Identifier: MIT */
/* The gyros of thigh, calf and belt: finds which part is in each place; one `gyros` message per sample instant, one
 * `motion` message beside it where parts of six axes are there and the host wants it, one `gyro_health` message per
 * gyro and second. */
#ifndef ECHOSTEP_GYROS_H
#define ECHOSTEP_GYROS_H

#include <stdint.h>

#define GYROS 3u
#define GYROS_RATE_MIN_HZ 10u
#define GYROS_RATE_MAX_HZ 200u

/* Applies the configured rate; the first sample is due in 20 ms. */
void gyros_start(uint32_t now);

/* Samples when a sample is due (0.1 to 0.4 ms); returns the time of the next call. */
uint32_t gyros_run(uint32_t now);

#endif
