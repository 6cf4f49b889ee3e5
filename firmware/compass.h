/* SPDX-License-Identifier: MIT */
/* The compass: finds which part is there; `compass` or `magnetic` messages at the configured rate. */
#ifndef ECHOSTEP_COMPASS_H
#define ECHOSTEP_COMPASS_H

#include <stdint.h>

#define COMPASS_RATE_MIN_HZ 1u
#define COMPASS_RATE_MAX_HZ 20u

/* Applies the configured rate; the first reading is due at once. */
void compass_start(uint32_t now);

/* Reads when a reading is due and no ranger trigger is near; returns the time of the next call, unless an interrupt
 * comes earlier. */
uint32_t compass_run(uint32_t now);

#endif
