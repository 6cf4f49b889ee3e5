/* SPDX-License-Identifier: MIT */
#include "cobs.h"

#define FULL_BLOCK 0xFFu /* code of a block of 254 bytes that no zero follows */

uint16_t cobs_encode(uint8_t *out, const uint8_t *in, uint16_t length)
{
	uint16_t code_index = 0, end = 1;
	uint8_t code = 1;
	for (uint16_t i = 0; i < length; i++) {
		if (code == FULL_BLOCK) {
			out[code_index] = code;
			code_index = end++;
			code = 1;
		}
		if (in[i]) {
			out[end++] = in[i];
			code++;
		} else {
			out[code_index] = code;
			code_index = end++;
			code = 1;
		}
	}
	out[code_index] = code;
	return end;
}

uint16_t cobs_decode(uint8_t *out, const uint8_t *in, uint16_t length)
{
	uint16_t end = 0, i = 0;
	while (i < length) {
		uint8_t code = in[i++];
		if (code == 0 || code - 1u > (uint16_t)(length - i))
			return 0;
		for (uint8_t n = 1; n < code; n++) {
			if (in[i] == 0)
				return 0;
			out[end++] = in[i++];
		}
		if (code != FULL_BLOCK && i < length)
			out[end++] = 0;
	}
	return end;
}
