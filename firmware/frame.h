/* SPDX-License-Identifier: MIT */
/* Frames: the payload is id u8, sequence u16, body, crc u16, little-endian; on the wire it is COBS(payload) and a zero
 * (protocol/README.md). Pure functions. */
#ifndef ECHOSTEP_FRAME_H
#define ECHOSTEP_FRAME_H

#include <stdint.h>
#include "cobs.h"     /* COBS_ENCODED_MAX */
#include "messages.h" /* MSG_MAX_SIZE */

#define FRAME_HEAD_SIZE 3u
#define FRAME_OVERHEAD 5u /* head and crc */
#define FRAME_PAYLOAD_MAX (FRAME_OVERHEAD + MSG_MAX_SIZE)
#define FRAME_ENCODED_MAX (COBS_ENCODED_MAX(FRAME_PAYLOAD_MAX) + 1u)

/* CRC-16 of `length` bytes: polynomial 0x1021, not reflected, initial value SCHEMA_SEED (identity and identify:
 * IDENTITY_SEED). */
uint16_t frame_crc(const uint8_t *payload, uint8_t length);

/* Writes head and crc around the body of `body_length` bytes at payload + FRAME_HEAD_SIZE, and encodes the payload with
 * its closing zero into `out` (FRAME_ENCODED_MAX bytes); returns the encoded length. */
uint8_t frame_encode(uint8_t *out, uint8_t *payload, uint8_t id, uint16_t sequence, uint8_t body_length);

/* Decodes the bytes between two zeros, in place: the id is then at bytes[0], the body at bytes + FRAME_HEAD_SIZE.
 * Returns the body's length, or -1 for bad stuffing, a payload shorter than FRAME_OVERHEAD, or a wrong checksum. */
int16_t frame_decode(uint8_t *bytes, uint8_t length);

#endif
