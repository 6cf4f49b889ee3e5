/* SPDX-License-Identifier: MIT */
#include "lsm6dso.h"
#include <string.h>   /* memcmp */
#include "messages.h" /* FAULT_* */

/* Registers and values [LSM6DSO data sheet DS12140, chapters 8 and 9]. */
#define REGISTER_INT2_CTRL 0x0Eu /* then the identity, and CTRL1_XL to CTRL9_XL */
#define REGISTER_CTRL2_G 0x11u
#define REGISTER_CTRL3_C 0x12u
#define REGISTER_CTRL5_C 0x14u
#define REGISTER_CTRL9_XL 0x18u
/* then a reserved one, then temperature, gyros, accelerometers: 16 bits each, low byte first */
#define REGISTER_STATUS 0x1Eu
#define READ_FLAG 0x80u
#define STATUS_RATE_READY 0x02u
#define STATUS_ZEROS 0xF8u /* bits of STATUS that are always zero; what the reserved register reads is not said */
#define NO_REPLY 0xFFu /* MISO is pulled up: an absent chip reads as ones */
#define CTRL1_XL_1667_HZ_8_G 0x8Eu /* low pass LPF2 on */
#define CTRL2_G_1667_HZ_1000_DPS 0x88u
#define CTRL2_G_1667_HZ_2000_DPS 0x8Cu
#define CTRL3_C_WHOLE_SAMPLES 0x44u /* BDU: no new value between the bytes of one; IF_INC: addresses count up */
#define CTRL4_C_SPI_ONLY_FILTER 0x06u /* I2C off, low pass LPF1 of the gyros on */
#define CTRL5_C_NEGATIVE 0x0Cu
#define CTRL5_C_POSITIVE 0x04u
#define CTRL8_XL_83_HZ 0x40u /* LPF2 at a twentieth of the rate: the part is polled at 200 Hz */
#define CTRL9_XL_I3C_OFF 0xE2u /* the reset value, and I3C off */
#define CTRL6_C_50_HZ 0x05u /* LPF1 at this rate; the ADIS16100 has 40 Hz */

#define READINGS_MAX 4u /* of a sample, which has no checksum, until two that follow each other are equal */
#define PROOFS 5u /* equal answers before a part is believed: an idle line may read as anything */
#define PROVING 2u /* registers of such an answer */

static const uint8_t settings[] FLASH = { /* from INT2_CTRL on */
	0, LSM6DSO_IDENTITY, CTRL1_XL_1667_HZ_8_G, CTRL2_G_1667_HZ_1000_DPS, CTRL3_C_WHOLE_SAMPLES,
	CTRL4_C_SPI_ONLY_FILTER, 0, CTRL6_C_50_HZ, 0, CTRL8_XL_83_HZ, CTRL9_XL_I3C_OFF,
};

/* Whether the first registers of the settings are as they must be. */
static bool has_settings(enum chip chip, uint8_t count)
{
	bool equal = true;
	(void)spi_begin(chip, SPI_MODE3, READ_FLAG | REGISTER_INT2_CTRL);
	for (uint8_t n = 0; n < count; n++)
		equal = spi_exchange(0) == flash_byte(&settings[n]) && equal;
	spi_release();
	return equal;
}

/* An ADIS16100 that takes the 24 clocks of a reading for a frame returns another second byte than a zero, or the same
 * byte twice; the writes have no effect on it. While I3C is on, frames for others may have confused a part: its
 * identity then reads 0 [STMicroelectronics/stm32-lsm6dso, issue 1]. A wrong bit may have left it with three wires, or
 * with addresses that do not count up. */
bool lsm6dso_answers(enum chip chip)
{
	spi_write(chip, SPI_MODE3, REGISTER_CTRL9_XL, CTRL9_XL_I3C_OFF);
	spi_write(chip, SPI_MODE3, REGISTER_CTRL3_C, CTRL3_C_WHOLE_SAMPLES);
	spi_write(chip, SPI_MODE3, REGISTER_INT2_CTRL, 0);
	for (uint8_t n = 0; n < PROOFS; n++)
		if (!has_settings(chip, PROVING))
			return false;
	return true;
}

/* The identity cannot be written. The addresses count up from the start: the default of IF_INC. */
void lsm6dso_start(enum chip chip)
{
	(void)spi_begin(chip, SPI_MODE3, REGISTER_INT2_CTRL);
	for (uint8_t n = 0; n < sizeof settings; n++)
		(void)spi_exchange(flash_byte(&settings[n]));
	spi_release();
}

bool lsm6dso_is_set(enum chip chip)
{
	return has_settings(chip, sizeof settings);
}

static int16_t read_word(void)
{
	uint8_t low = spi_exchange(0), high = spi_exchange(0);
	return (int16_t)(uint16_t)((uint16_t)high << 8 | low);
}

/* Returns STATUS. */
static uint8_t read_once(enum chip chip, struct lsm6dso_sample *out)
{
	(void)spi_begin(chip, SPI_MODE3, READ_FLAG | REGISTER_STATUS);
	uint8_t flags = spi_exchange(0);
	(void)spi_exchange(0); /* reserved */
	out->temperature = read_word();
	for (uint8_t k = 0; k < LSM6DSO_AXES; k++)
		out->axes[k] = read_word();
	spi_release();
	return flags;
}

/* Between two readings the part may have measured rates or forces anew; each at most once within four readings, which
 * take 0.6 ms. */
uint8_t lsm6dso_read(enum chip chip, struct lsm6dso_sample *out)
{
	struct lsm6dso_sample before;
	uint8_t flags = read_once(chip, out);
	if (flags == NO_REPLY)
		return FAULT_NO_ANSWER;
	if (flags & STATUS_ZEROS)
		return FAULT_BAD_VALUE;
	if (!(flags & STATUS_RATE_READY))
		return FAULT_NEVER_READY;
	for (uint8_t n = 1; n < READINGS_MAX; n++) {
		before = *out;
		(void)read_once(chip, out);
		if (memcmp(&before, out, sizeof before) == 0)
			return FAULT_NONE;
	}
	return FAULT_BAD_VALUE;
}

void lsm6dso_excite(enum chip chip, enum excitation excitation)
{
	uint8_t range = excitation == EXCITE_NONE ? CTRL2_G_1667_HZ_1000_DPS : CTRL2_G_1667_HZ_2000_DPS;
	uint8_t sign = excitation == EXCITE_ST1 ? CTRL5_C_NEGATIVE : excitation == EXCITE_ST2 ? CTRL5_C_POSITIVE : 0;
	spi_write(chip, SPI_MODE3, REGISTER_CTRL2_G, range);
	spi_write(chip, SPI_MODE3, REGISTER_CTRL5_C, sign);
}
