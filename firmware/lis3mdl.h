/* SPDX-License-Identifier: MIT */
/* ST LIS3MDL, a magnetometer of three axes on I2C. */
#ifndef ECHOSTEP_LIS3MDL_H
#define ECHOSTEP_LIS3MDL_H

#include "board.h" /* struct twi_transfer */

/* The transfers that find and start it, one after the other, then those that read its settings back, and its
 * samples. */
enum lis3mdl_step { LIS3MDL_IDENTITY, LIS3MDL_SETTINGS, LIS3MDL_MORE_SETTINGS, LIS3MDL_CHECK, LIS3MDL_SAMPLE };

/* The transfer of a step; `second`: at the chip's other address. */
void lis3mdl_prepare(struct twi_transfer *transfer, enum lis3mdl_step step, bool second);

/* Whether a finished transfer of LIS3MDL_IDENTITY came from one. */
bool lis3mdl_answers(const struct twi_transfer *transfer);

/* Whether a finished transfer of LIS3MDL_CHECK has read all settings as written. */
bool lis3mdl_is_set(const struct twi_transfer *transfer);

#define LIS3MDL_AGAIN 0xFFu

/* Sends the field of a finished transfer of LIS3MDL_SAMPLE to a host that wants it, if it is as the one before; returns
 * FAULT_*, or LIS3MDL_AGAIN: one more is needed. */
uint8_t lis3mdl_finish(const struct twi_transfer *transfer);

#endif
