/* SPDX-License-Identifier: MIT */
#include "frame.h"

/* Adds one byte to a CRC-16/XMODEM, without a table and without a loop over its bits. */
static uint16_t crc_byte(uint16_t crc, uint8_t byte)
{
	crc = (uint16_t)((crc >> 8) | (crc << 8));
	crc = (uint16_t)(crc ^ byte);
	crc = (uint16_t)(crc ^ ((crc & 0xFFu) >> 4));
	crc = (uint16_t)(crc ^ (crc << 12));
	return (uint16_t)(crc ^ ((crc & 0xFFu) << 5));
}

uint16_t frame_crc(const uint8_t *payload, uint8_t length)
{
	uint16_t crc = payload[0] == MSG_IDENTITY || payload[0] == MSG_IDENTIFY ? IDENTITY_SEED : SCHEMA_SEED;
	while (length--)
		crc = crc_byte(crc, *payload++);
	return crc;
}

uint8_t frame_encode(uint8_t *out, uint8_t *payload, uint8_t id, uint16_t sequence, uint8_t body_length)
{
	uint8_t length = (uint8_t)(FRAME_HEAD_SIZE + body_length);
	payload[0] = id;
	payload[1] = (uint8_t)sequence;
	payload[2] = (uint8_t)(sequence >> 8);
	uint16_t crc = frame_crc(payload, length);
	payload[length++] = (uint8_t)crc;
	payload[length++] = (uint8_t)(crc >> 8);
	uint8_t end = (uint8_t)cobs_encode(out, payload, length);
	out[end++] = 0;
	return end;
}

int16_t frame_decode(uint8_t *bytes, uint8_t length)
{
	uint8_t decoded = (uint8_t)cobs_decode(bytes, bytes, length);
	if (decoded < FRAME_OVERHEAD)
		return -1;
	uint8_t covered = (uint8_t)(decoded - 2u);
	uint16_t crc = (uint16_t)(bytes[covered] | (uint16_t)bytes[covered + 1u] << 8);
	return crc == frame_crc(bytes, covered) ? (int16_t)(decoded - FRAME_OVERHEAD) : (int16_t)-1;
}
