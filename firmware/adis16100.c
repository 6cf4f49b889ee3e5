/* SPDX-License-Identifier: MIT */
#include "adis16100.h"
#include "messages.h" /* FAULT_*, MSG_GYROS_INVALID */

/* Command bits [ADIS16100 datasheet]: WRITE, a channel, normal power, two's complement. Each 16-bit frame returns the
 * reply to the previous frame: channel in bits 13:12, value in bits 11:0. */
#define COMMAND_RATE 0x8300u
#define COMMAND_TEMPERATURE 0x8700u
#define CHANNEL_RATE 0x0000u
#define CHANNEL_TEMPERATURE 0x1000u
#define CHANNEL_MASK 0xF000u /* both leading zeros and the channel */
#define IDLE_HIGH 0xFFFFu    /* an absent chip reads as what MISO's pull-up, */
#define IDLE_LOW 0x0000u     /* or the pull-downs of other boards make of it; also the proper reply of a rate of zero */
#define VALUE_MASK 0x0FFFu
#define SIGN_BIT 0x0800

/* One frame: sends `command`, returns the reply to the previous frame. */
static uint16_t exchange(enum chip chip, uint16_t command)
{
	uint8_t high = spi_begin(chip, SPI_ADIS16100, (uint8_t)(command >> 8));
	uint8_t low = spi_exchange((uint8_t)(command & 0xFFu));
	spi_release();
	return (uint16_t)((uint16_t)high << 8 | low);
}

/* Counts of a reply; MSG_GYROS_INVALID when it names another channel. */
static int16_t value_of(uint16_t reply, uint16_t channel, uint8_t *fault)
{
	if ((reply & CHANNEL_MASK) != channel) {
		*fault = reply == IDLE_HIGH || reply == IDLE_LOW ? FAULT_NO_ANSWER : FAULT_WRONG_CHANNEL;
		return MSG_GYROS_INVALID;
	}
	*fault = FAULT_NONE;
	return (int16_t)((int16_t)((reply & VALUE_MASK) ^ SIGN_BIT) - SIGN_BIT);
}

void adis16100_convert(enum chip chip)
{
	(void)exchange(chip, COMMAND_RATE);
}

int16_t adis16100_rate(enum chip chip, uint8_t *fault)
{
	return value_of(exchange(chip, COMMAND_RATE), CHANNEL_RATE, fault);
}

/* One frame requests the temperature; the next frame returns it and requests the rate again. */
int16_t adis16100_temperature(enum chip chip, uint8_t *fault)
{
	(void)exchange(chip, COMMAND_TEMPERATURE);
	return value_of(exchange(chip, COMMAND_RATE), CHANNEL_TEMPERATURE, fault);
}
