/* SPDX-License-Identifier: MIT */
/* Devantech CMPS10, a compass on I2C, or another one with the bearing in the same registers. */
#ifndef ECHOSTEP_CMPS10_H
#define ECHOSTEP_CMPS10_H

#include "board.h" /* struct twi_transfer */

/* The transfer that reads the bearing. */
void cmps10_prepare(struct twi_transfer *transfer);

/* Sends the bearing of a finished transfer; returns FAULT_*. */
uint8_t cmps10_finish(const struct twi_transfer *transfer);

/* Sends that there was none. */
void cmps10_send_none(uint32_t now);

#endif
