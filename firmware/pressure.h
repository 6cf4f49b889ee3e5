/* SPDX-License-Identifier: MIT */
/* The barometer: finds which one is on its chip select, starts it, starts it again after a failure; one `pressure`
 * message per sample. */
#ifndef ECHOSTEP_PRESSURE_H
#define ECHOSTEP_PRESSURE_H

#include <stdbool.h>
#include <stdint.h>

/* Finds and starts the barometer in 150 ms; the first sample comes after about 0.2 s. */
void pressure_start(uint32_t now);

/* Does the next step of the start, or reads a sample that is ready (0.6 ms); returns the time of the next call. */
uint32_t pressure_run(uint32_t now);

/* What a driver's step has come to. */
struct pressure_step {
	uint32_t pressure;   /* counts of 0.25 Pa; 0: this step has measured none */
	int16_t temperature; /* counts of 0.05 degC */
	/* its settings or two readings of a sample differed: there may be no pressure, and it goes on */
	bool wrong_bits;
	uint8_t fault;       /* FAULT_*; not FAULT_NONE: the barometer must be sought anew */
};

#endif
