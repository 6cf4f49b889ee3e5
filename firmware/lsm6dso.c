/* SPDX-License-Identifier: MIT */
#include "lsm6dso.h"
#include "messages.h" /* FAULT_* */

/* Registers and values [LSM6DSO data sheet DS12140, chapters 8 and 9]. */
#define REGISTER_BEFORE_WHO_AM_I 0x0Eu /* INT2_CTRL, never written: 0 */
#define REGISTER_CTRL1_XL 0x10u
#define REGISTER_CTRL2_G 0x11u
#define REGISTER_CTRL5_C 0x14u
#define REGISTER_STATUS 0x1Eu /* then a reserved one, then temperature, gyros, accelerometers: 16 bits each, low byte first */
#define READ_FLAG 0x80u
#define STATUS_RATE_READY 0x02u
#define STATUS_ZEROS 0xF8u /* bits of STATUS that are always zero, as is the reserved register: in a sample the only bits that are known */
#define NO_REPLY 0xFFu /* MISO is pulled up: an absent chip reads as ones */
#define CTRL1_XL_1667_HZ_8_G 0x8Eu /* low pass LPF2 on */
#define CTRL2_G_1667_HZ_1000_DPS 0x88u
#define CTRL2_G_1667_HZ_2000_DPS 0x8Cu
#define CTRL3_C_WHOLE_SAMPLES 0x44u /* BDU: no new value between the bytes of one; IF_INC: addresses count up */
#define CTRL4_C_SPI_ONLY_FILTER 0x06u /* I2C off, low pass LPF1 of the gyros on */
#define CTRL5_C_NEGATIVE 0x0Cu
#define CTRL5_C_POSITIVE 0x04u
#define CTRL8_XL_83_HZ 0x40u /* LPF2 at a twentieth of the rate: the part is polled at 200 Hz */
#define CTRL9_XL_I3C_OFF 0xE2u /* the reset value, and I3C off: else frames for the others on the bus may confuse a part [STMicroelectronics/stm32-lsm6dso, issue 1] */
#define CTRL6_C_50_HZ 0x05u /* LPF1 at this rate; the ADIS16100 has 40 Hz */

#define SAMPLE_OFFSET 2u /* bytes of STATUS and of the reserved register */
#define SAMPLE_WORDS (1u + LSM6DSO_AXES)

/* An ADIS16100 that takes these 24 clocks for a frame returns another second byte than a zero, or the same byte twice. */
bool lsm6dso_answers(enum chip chip)
{
	(void)spi_begin(chip, SPI_MODE3, READ_FLAG | REGISTER_BEFORE_WHO_AM_I);
	uint8_t before = spi_exchange(0), identity = spi_exchange(0);
	spi_release();
	return before == 0 && identity == LSM6DSO_IDENTITY;
}

void lsm6dso_start(enum chip chip)
{
	static const uint8_t settings[] FLASH = {
		CTRL1_XL_1667_HZ_8_G, CTRL2_G_1667_HZ_1000_DPS, CTRL3_C_WHOLE_SAMPLES, CTRL4_C_SPI_ONLY_FILTER, 0, CTRL6_C_50_HZ,
		0, CTRL8_XL_83_HZ, CTRL9_XL_I3C_OFF,
	};
	(void)spi_begin(chip, SPI_MODE3, REGISTER_CTRL1_XL); /* the addresses count up from the start: the default of IF_INC */
	for (uint8_t n = 0; n < sizeof settings; n++)
		(void)spi_exchange(flash_byte(&settings[n]));
	spi_release();
}

static int16_t read_word(void)
{
	uint8_t low = spi_exchange(0), high = spi_exchange(0);
	return (int16_t)(uint16_t)((uint16_t)high << 8 | low);
}

uint8_t lsm6dso_read(enum chip chip, struct lsm6dso_sample *out)
{
	(void)spi_begin(chip, SPI_MODE3, READ_FLAG | REGISTER_STATUS);
	uint8_t flags = spi_exchange(0), reserved = spi_exchange(0);
	out->temperature = read_word();
	for (uint8_t k = 0; k < LSM6DSO_AXES; k++)
		out->axes[k] = read_word();
	spi_release();
	if (flags == NO_REPLY && reserved == NO_REPLY)
		return FAULT_NO_ANSWER;
	if ((flags & STATUS_ZEROS) || reserved)
		return FAULT_BAD_VALUE;
	return flags & STATUS_RATE_READY ? FAULT_NONE : FAULT_NEVER_READY;
}

void lsm6dso_excite(enum chip chip, enum excitation excitation)
{
	spi_write(chip, SPI_MODE3, REGISTER_CTRL2_G, excitation == EXCITE_NONE ? CTRL2_G_1667_HZ_1000_DPS : CTRL2_G_1667_HZ_2000_DPS);
	spi_write(chip, SPI_MODE3, REGISTER_CTRL5_C, excitation == EXCITE_ST1 ? CTRL5_C_NEGATIVE : excitation == EXCITE_ST2 ? CTRL5_C_POSITIVE : 0);
}
