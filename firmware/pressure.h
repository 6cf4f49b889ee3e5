/* SPDX-License-Identifier: MIT */
/* VTI SCP1000-D01: the barometer. Starts it, restarts it after a failure, one `pressure` message per sample. */
#ifndef ECHOSTEP_PRESSURE_H
#define ECHOSTEP_PRESSURE_H

#include <stdint.h>

/* Resets the chip and starts it in the configured mode; the first sample comes after about 0.2 s. */
void pressure_start(uint32_t now);

/* Does the next step of the start, or reads a sample that is ready (0.3 ms); returns the time of the next call. */
uint32_t pressure_run(uint32_t now);

#endif
