/* SPDX-License-Identifier: MIT */
/* Analog Devices ADIS16100, a rate gyro on SPI. */
#ifndef ECHOSTEP_ADIS16100_H
#define ECHOSTEP_ADIS16100_H

#include <stdint.h>
#include "board.h" /* enum chip */

/* Makes the chip convert now: its next reply has the rate of this instant. */
void adis16100_convert(enum chip chip);

/* Rate and temperature in counts of `gyros` and `gyro_health`; `fault` is FAULT_NONE, or why the value is INVALID. */
int16_t adis16100_rate(enum chip chip, uint8_t *fault);
int16_t adis16100_temperature(enum chip chip, uint8_t *fault);

#endif
