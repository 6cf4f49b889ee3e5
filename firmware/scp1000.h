/* SPDX-License-Identifier: MIT */
/* VTI SCP1000-D01, a barometer on SPI. */
#ifndef ECHOSTEP_SCP1000_H
#define ECHOSTEP_SCP1000_H

#include <stdint.h>
#include "pressure.h" /* struct pressure_step */

/* Resets the chip; returns the time of the first scp1000_run; the next ones follow every few ms. */
uint32_t scp1000_start(uint32_t now);

/* Does the next step of the start, or reads a sample that is ready (0.3 ms); `out` begins with zeros. */
void scp1000_run(uint32_t now, struct pressure_step *out);

#endif
