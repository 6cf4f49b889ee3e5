/* SPDX-License-Identifier: MIT */
/* ST LSM6DSO and LSM6DSOX: gyros and accelerometers of three axes, on SPI. */
#ifndef ECHOSTEP_LSM6DSO_H
#define ECHOSTEP_LSM6DSO_H

#include <stdbool.h>
#include <stdint.h>
#include "board.h" /* enum chip, enum excitation */

#define LSM6DSO_IDENTITY 0x6Cu
#define LSM6DSO_AXES 6u /* rates about x, y, z (0.035 deg/s), then specific forces (0.244 mg) */
#define LSM6DSO_Z 2u

struct lsm6dso_sample {
	int16_t axes[LSM6DSO_AXES];
	int16_t temperature; /* 1/256 degC from 25 degC */
};

/* Whether an LSM6DSO is on this chip select, by five equal answers (0.4 ms). */
bool lsm6dso_answers(enum chip chip);

/* Writes its settings; the first rate comes after 70 ms. A chip that measures with them already goes on. */
void lsm6dso_start(enum chip chip);

/* Whether all settings are as written (0.1 ms); not while it is excited. */
bool lsm6dso_is_set(enum chip chip);

/* The newest sample (0.3 to 0.6 ms); FAULT_NO_ANSWER: the chip is not there, FAULT_NEVER_READY: it has none,
 * FAULT_BAD_VALUE: wrong bits. */
uint8_t lsm6dso_read(enum chip chip, struct lsm6dso_sample *out);

/* Its self-test: ST1 of negative sign, ST2 of positive sign. While it is excited, a count of its rates is 0.07 deg/s:
 * the data sheet's limits are those of 2000 deg/s. */
void lsm6dso_excite(enum chip chip, enum excitation excitation);

#endif
