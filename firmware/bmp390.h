/* SPDX-License-Identifier: MIT */
/* Bosch BMP390, a barometer on SPI. */
#ifndef ECHOSTEP_BMP390_H
#define ECHOSTEP_BMP390_H

#include <stdbool.h>
#include <stdint.h>
#include "pressure.h" /* struct pressure_step */

/* Whether a BMP390 is on the barometer's chip select; notes the identity that it read. */
bool bmp390_answers(void);

/* Resets the chip; returns the time of the first bmp390_run; the next ones follow every few ms. */
uint32_t bmp390_start(uint32_t now);

/* Does the next step of the start, or reads a sample that is ready (0.5 ms); `out` begins with zeros. */
void bmp390_run(uint32_t now, struct pressure_step *out);

#endif
