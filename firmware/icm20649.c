/* SPDX-License-Identifier: MIT */
#include "icm20649.h"
#include <string.h>   /* memcmp */
#include "messages.h" /* FAULT_* */

/* Registers and values [ICM-20649 data sheet DS-000192, chapters 7 to 10]. Of user bank 0: */
#define REGISTER_WHO_AM_I 0x00u
#define REGISTER_USER_CTRL 0x03u
#define REGISTER_PWR_MGMT_1 0x06u
#define REGISTER_INT_ENABLE_1 0x11u
#define REGISTER_ACCEL_XOUT_H 0x2Du /* forces, rates, temperature: 16 bits each, high byte first */
#define REGISTER_BANK_SEL 0x7Fu     /* of every bank */
/* Of user bank 2: */
#define REGISTER_GYRO_SMPLRT_DIV 0x00u
#define REGISTER_GYRO_CONFIG_1 0x01u
#define REGISTER_ACCEL_SMPLRT_DIV_2 0x11u
#define REGISTER_ACCEL_CONFIG 0x14u

#define READ_FLAG 0x80u
#define BANK_0 0x00u
#define BANK_2 0x20u
#define SPI_ONLY 0x10u
#define DEVICE_RESET 0x80u
#define RESERVED 0x10u /* bit 4 of PWR_MGMT_1 */
#define BEST_CLOCK 0x01u
#define RAW_DATA_READY 0x01u      /* INT1 rises for 50 us with each sample */
#define DIVIDER 4u                /* 1125 Hz / (1 + 4) = 225 Hz */
#define GYRO_120_HZ_4000_DPS 0x17u /* low pass 2, full scale 3, low pass on */
#define ACCEL_111_HZ_30_G 0x17u
#define PROOFS 5u
#define NO_REPLY (-1) /* MISO is pulled up: an absent chip reads as ones */

static uint8_t read8(enum chip chip, uint8_t address)
{
	(void)spi_begin(chip, SPI_MODE3, READ_FLAG | address);
	uint8_t value = spi_exchange(0);
	spi_release();
	return value;
}

/* When the processor was reset while it wrote settings, bank 2 is still selected, and has the divider at this
 * address. */
uint8_t icm20649_identity(enum chip chip)
{
	uint8_t identity = read8(chip, REGISTER_WHO_AM_I);
	if (identity != DIVIDER)
		return identity;
	spi_write(chip, SPI_MODE3, REGISTER_BANK_SEL, BANK_0);
	return read8(chip, REGISTER_WHO_AM_I);
}

/* Two registers, since another part's reply may be like one of them by chance, and five times, since that of an idle
 * line may be like both. Of the second one only the bits that are always zero count: a frame for another part may have
 * written the rest. */
bool icm20649_answers(enum chip chip)
{
	for (uint8_t n = 0; n < PROOFS; n++) {
		if (icm20649_identity(chip) != ICM20649_IDENTITY)
			return false;
		if (read8(chip, REGISTER_PWR_MGMT_1) & (DEVICE_RESET | RESERVED))
			return false;
	}
	return true;
}

void icm20649_reset(enum chip chip)
{
	spi_write(chip, SPI_MODE3, REGISTER_PWR_MGMT_1, DEVICE_RESET);
}

static const uint8_t settings[][2] FLASH = {
	{ REGISTER_BANK_SEL, BANK_0 },
	{ REGISTER_PWR_MGMT_1, BEST_CLOCK },
	{ REGISTER_USER_CTRL, SPI_ONLY },
	{ REGISTER_BANK_SEL, BANK_2 },
	{ REGISTER_GYRO_SMPLRT_DIV, DIVIDER },
	{ REGISTER_GYRO_CONFIG_1, GYRO_120_HZ_4000_DPS },
	{ REGISTER_ACCEL_SMPLRT_DIV_2, DIVIDER },
	{ REGISTER_ACCEL_CONFIG, ACCEL_111_HZ_30_G },
	{ REGISTER_BANK_SEL, BANK_0 },
	{ REGISTER_INT_ENABLE_1, RAW_DATA_READY },
};

/* Writes the settings, or reads them back, whose banks must be selected all the same; true: none differs. */
static bool go_through_settings(enum chip chip, bool writes)
{
	bool equal = true;
	for (uint8_t n = 0; n < sizeof settings / sizeof *settings; n++) {
		uint8_t address = flash_byte(&settings[n][0]), value = flash_byte(&settings[n][1]);
		if (writes || address == REGISTER_BANK_SEL)
			spi_write(chip, SPI_MODE3, address, value);
		else
			equal = read8(chip, address) == value && equal;
	}
	return equal;
}

void icm20649_start(enum chip chip)
{
	(void)go_through_settings(chip, true);
}

bool icm20649_is_set(enum chip chip)
{
	return go_through_settings(chip, false);
}

static int16_t read_word(void)
{
	uint8_t high = spi_exchange(0), low = spi_exchange(0);
	return (int16_t)(uint16_t)((uint16_t)high << 8 | low);
}

/* true: it is neither all ones nor all zeros. */
static bool read_once(enum chip chip, struct icm20649_sample *out)
{
	bool replies = false;
	(void)spi_begin(chip, SPI_MODE3, READ_FLAG | REGISTER_ACCEL_XOUT_H);
	for (uint8_t k = 0; k < ICM20649_AXES; k++) {
		out->axes[k] = read_word();
		replies = replies || (out->axes[k] != NO_REPLY && out->axes[k] != 0);
	}
	out->temperature = read_word();
	spi_release();
	return replies;
}

uint8_t icm20649_read(enum chip chip, struct icm20649_sample *out)
{
	struct icm20649_sample again;
	bool replies = read_once(chip, out);
	if (!read_once(chip, &again) && !replies)
		return FAULT_NO_ANSWER;
	return memcmp(out, &again, sizeof again) ? FAULT_BAD_VALUE : FAULT_NONE;
}
