/* SPDX-License-Identifier: MIT */
/* TDK ICM-20649: gyros of 4000 deg/s and accelerometers of 30 g, on SPI; its INT1 pulses with each sample. */
#ifndef ECHOSTEP_ICM20649_H
#define ECHOSTEP_ICM20649_H

#include <stdbool.h>
#include <stdint.h>
#include "board.h" /* enum chip */

#define ICM20649_IDENTITY 0xE1u
#define ICM20649_AXES 6u /* specific forces along x, y, z (1/1024 g), then rates (1/8.2 deg/s) */

struct icm20649_sample {
	int16_t axes[ICM20649_AXES];
	int16_t temperature; /* 1/333.87 degC from 21 degC */
};

/* Content of the identity register of what is on this chip select. */
uint8_t icm20649_identity(enum chip chip);

/* Whether it is an ICM-20649, by five equal answers (0.3 ms). */
bool icm20649_answers(enum chip chip);

/* Resets the part; it must be left alone for 100 ms. */
void icm20649_reset(enum chip chip);

/* Writes its settings after a reset: 225 samples a second. */
void icm20649_start(enum chip chip);

/* Whether all settings are as written (0.3 ms). */
bool icm20649_is_set(enum chip chip);

/* The newest sample, read twice (0.3 ms), since it has no checksum. FAULT_NO_ANSWER: the part is not there;
 * FAULT_BAD_VALUE: the two differ. */
uint8_t icm20649_read(enum chip chip, struct icm20649_sample *out);

#endif
