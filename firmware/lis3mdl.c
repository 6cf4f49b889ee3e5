/* SPDX-License-Identifier: MIT */
#include "lis3mdl.h"
#include <string.h> /* memcmp */
#include "link.h"   /* sending the messages */
#include "parts.h"  /* what was found */

/* Registers and values [LIS3MDL data sheet, chapters 6 and 7]. */
#define ADDRESS_LOW 0x1Cu  /* SA1 low */
#define ADDRESS_HIGH 0x1Eu /* SA1 high */
#define COUNT_UP 0x80u     /* the addresses of a transfer count up */
#define REGISTER_WHO_AM_I 0x0Fu
#define REGISTER_CTRL_REG1 0x20u
#define REGISTER_CTRL_REG4 0x23u
#define REGISTER_STATUS 0x27u /* then x, y, z: 16 bits each, low byte first */
#define IDENTITY 0x3Du
#define CTRL_REG1_FINEST_80_HZ 0x7Cu
#define CTRL_REG2_4_GAUSS 0x00u
#define CTRL_REG3_CONTINUOUS 0x00u
#define CTRL_REG4_FINEST_Z 0x0Cu
#define CTRL_REG5_WHOLE_SAMPLES 0x40u
#define STATUS_READY 0x08u
#define SAMPLE_LENGTH 7u
#define READINGS_MAX 4u /* of a sample, which has no checksum, until two that follow each other are equal */

static const uint8_t steps[][6] FLASH = { /* bytes to write, bytes to read, the bytes */
	[LIS3MDL_IDENTITY] = { 1, 1, REGISTER_WHO_AM_I },
	[LIS3MDL_SETTINGS] = {
		4, 0, COUNT_UP | REGISTER_CTRL_REG1, CTRL_REG1_FINEST_80_HZ, CTRL_REG2_4_GAUSS, CTRL_REG3_CONTINUOUS,
	},
	[LIS3MDL_MORE_SETTINGS] = { 3, 0, COUNT_UP | REGISTER_CTRL_REG4, CTRL_REG4_FINEST_Z, CTRL_REG5_WHOLE_SAMPLES },
	[LIS3MDL_CHECK] = { 1, 5, COUNT_UP | REGISTER_CTRL_REG1 },
	[LIS3MDL_SAMPLE] = { 1, SAMPLE_LENGTH, COUNT_UP | REGISTER_STATUS },
};

void lis3mdl_prepare(struct twi_transfer *transfer, enum lis3mdl_step step, bool second)
{
	transfer->address = second ? ADDRESS_HIGH : ADDRESS_LOW;
	transfer->write_length = flash_byte(&steps[step][0]);
	transfer->read_length = flash_byte(&steps[step][1]);
	for (uint8_t n = 2; n < sizeof steps[step]; n++)
		transfer->bytes[n - 2] = flash_byte(&steps[step][n]);
}

bool lis3mdl_answers(const struct twi_transfer *transfer)
{
	uint8_t identity = transfer->bytes[0];
	bool answers = identity == IDENTITY;
	if (answers || parts_in(DEVICE_COMPASS) == PART_NONE)
		parts_found(DEVICE_COMPASS, answers ? PART_LIS3MDL : PART_NONE, identity);
	return answers;
}

bool lis3mdl_is_set(const struct twi_transfer *transfer)
{
	bool equal = true;
	for (uint8_t n = 0; n < 5; n++) {
		const uint8_t *written = n < 3 ? &steps[LIS3MDL_SETTINGS][3 + n] : &steps[LIS3MDL_MORE_SETTINGS][n];
		equal = transfer->bytes[n] == flash_byte(written) && equal;
	}
	return equal;
}

static int16_t word(const uint8_t *bytes)
{
	return (int16_t)(uint16_t)((uint16_t)bytes[1] << 8 | bytes[0]);
}

uint8_t lis3mdl_finish(const struct twi_transfer *transfer)
{
	static uint8_t before[SAMPLE_LENGTH - 1u], readings;
	const uint8_t *b = transfer->bytes;
	bool first = !readings, equal = !first && memcmp(before, b + 1, sizeof before) == 0;
	if (first && !(b[0] & STATUS_READY))
		return FAULT_NEVER_READY;
	memcpy(before, b + 1, sizeof before);
	if (!equal && ++readings < READINGS_MAX)
		return LIS3MDL_AGAIN;
	readings = 0;
	if (!equal)
		return FAULT_BAD_VALUE;
	struct msg_magnetic m = { transfer->ticks, word(b + 1), word(b + 3), word(b + 5) };
	if (link_wants(REPORTS_MAGNETIC))
		link_send(MSG_MAGNETIC, msg_pack_magnetic(link_body(), &m));
	return FAULT_NONE;
}
