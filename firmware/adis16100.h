/* The three ADIS16100 rate gyros (thigh, calf, belt): one `gyros` message per sample instant. */
#ifndef ECHOSTEP_ADIS16100_H
#define ECHOSTEP_ADIS16100_H

#include <stdint.h>

/* Takes the configured rate; the first sample is due at once. */
void gyros_start(uint32_t now);

/* Samples when it is due (0.1 ms); returns when to call again. */
uint32_t gyros_run(uint32_t now);

#endif
