/* SPDX-License-Identifier: MIT */
/* VTI SCP1000-D01, a barometer on SPI. */
#ifndef ECHOSTEP_SCP1000_H
#define ECHOSTEP_SCP1000_H

#include <stdint.h>

/* Resets the chip; returns the time of the next scp1000_run. */
uint32_t scp1000_start(uint32_t now);

/* Does the next step of the start, or reads a sample that is ready (0.3 ms); returns the time of the next call. */
uint32_t scp1000_run(uint32_t now);

#endif
