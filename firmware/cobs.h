/* SPDX-License-Identifier: MIT */
/* Consistent Overhead Byte Stuffing [Cheshire and Baker 1999], without the closing zero. Pure functions. */
#ifndef ECHOSTEP_COBS_H
#define ECHOSTEP_COBS_H

#include <stdint.h>

/* Encoded length of `length` bytes in the worst case. */
#define COBS_ENCODED_MAX(length) ((length) + (length) / 254u + 1u)

/* Encodes into `out`, which has room for COBS_ENCODED_MAX(length) and does not overlap `in`; returns the encoded
 * length. */
uint16_t cobs_encode(uint8_t *out, const uint8_t *in, uint16_t length);

/* Decodes into `out`, which has room for `length` bytes and may be `in`; returns the decoded length. 0: `in` is empty,
 * ends inside a block or contains a zero. */
uint16_t cobs_decode(uint8_t *out, const uint8_t *in, uint16_t length);

#endif
