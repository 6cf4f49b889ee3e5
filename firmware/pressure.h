/* SPDX-License-Identifier: MIT */
/* The barometer: finds which one is on its chip select, starts it, starts it again after a failure; one `pressure` message per sample. */
#ifndef ECHOSTEP_PRESSURE_H
#define ECHOSTEP_PRESSURE_H

#include <stdint.h>

/* Finds and starts the barometer in 5 ms; the first sample comes after about 0.2 s. */
void pressure_start(uint32_t now);

/* Does the next step of the start, or reads a sample that is ready (0.3 ms); returns the time of the next call. */
uint32_t pressure_run(uint32_t now);

/* For the drivers. */

/* Sends a sample: counts of 0.25 Pa (not 0) and of 0.05 degC, measured at `now`. */
void pressure_report(uint32_t now, uint32_t pressure, int16_t temperature);

/* Counts the failure (FAULT_*); returns the time at which the barometer is sought anew. */
uint32_t pressure_failed(uint32_t now, uint8_t fault);

#endif
