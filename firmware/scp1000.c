/* SPDX-License-Identifier: MIT */
#include "scp1000.h"
#include "board.h"         /* spi_* */
#include "configuration.h" /* mode */
#include "messages.h"      /* FAULT_* */
#include "parts.h"         /* what was found */

/* Registers and start-up sequence [SCP1000-D01 datasheet]. */
#define REGISTER_REVISION 0x00u /* never all zeros or ones */
#define REGISTER_OPERATION 0x03u
#define REGISTER_RESET 0x06u
#define REGISTER_STATUS 0x07u
#define REGISTER_DATARD8 0x1Fu  /* after a reset: result of the EEPROM check; then pressure, bits 18:16 */
#define REGISTER_DATARD16 0x20u /* pressure, bits 15:0; reading it clears DRDY */
#define REGISTER_TEMPOUT 0x21u
#define WRITE_FLAG 0x02u
#define STATUS_STARTING 0x01u
#define EEPROM_OK 0x01u
#define OPERATION_STOP 0x00u
#define OPERATION_HIGH_SPEED 0x09u
#define OPERATION_HIGH_RESOLUTION 0x0Au
#define PRESSURE_HIGH_MASK 0x07u
#define NO_REPLY 0xFFu /* MISO is pulled up: an absent chip reads as ones */
#define HELD_LOW 0x00u /* MISO is held low, or the chip has no supply */
#define TEMPERATURE_MASK 0x3FFFu
#define TEMPERATURE_SIGN 0x2000

#define RESET_TICKS (60u * TICKS_PER_MS)         /* busy after a reset */
#define STARTING_MAX_TICKS (150u * TICKS_PER_MS) /* after that: limit of the start */
/* the fast mode needs 110 ms per sample: an earlier DRDY is a stuck line */
#define SAMPLE_MIN_TICKS (50u * TICKS_PER_MS)
#define SAMPLE_MAX_TICKS (2u * TICKS_PER_S)   /* the slow mode needs 560 ms per sample */

static bool measuring;
/* Times in ticks of the board's clock. */
static uint32_t earliest; /* DRDY before this time is an error */
static uint32_t deadline; /* of the start, or of the next sample */

static uint8_t read8(uint8_t address)
{
	(void)spi_begin(CHIP_PRESSURE, SPI_SCP1000, (uint8_t)(address << 2));
	uint8_t value = spi_exchange(0);
	spi_release();
	return value;
}

static uint16_t read16(uint8_t address)
{
	(void)spi_begin(CHIP_PRESSURE, SPI_SCP1000, (uint8_t)(address << 2));
	uint8_t high = spi_exchange(0), low = spi_exchange(0);
	spi_release();
	return (uint16_t)((uint16_t)high << 8 | low);
}

static void write8(uint8_t address, uint8_t value)
{
	spi_write(CHIP_PRESSURE, SPI_SCP1000, (uint8_t)((unsigned)address << 2 | WRITE_FLAG), value);
}

uint32_t scp1000_start(uint32_t now)
{
	write8(REGISTER_OPERATION, OPERATION_STOP); /* after a reset of the board alone the chip is still measuring */
	write8(REGISTER_RESET, 1);
	measuring = false;
	deadline = now + RESET_TICKS + STARTING_MAX_TICKS;
	return now + RESET_TICKS;
}

static uint8_t await_sample(uint32_t now)
{
	earliest = now + SAMPLE_MIN_TICKS;
	deadline = now + SAMPLE_MAX_TICKS;
	return FAULT_NONE;
}

static uint8_t measure(uint32_t now)
{
	bool slow = configuration.pressure_mode == PRESSURE_MODE_HIGH_RESOLUTION;
	write8(REGISTER_OPERATION, slow ? OPERATION_HIGH_RESOLUTION : OPERATION_HIGH_SPEED);
	measuring = true;
	return await_sample(now);
}

/* Polls the start: a chip that answers has left STARTING and passed its EEPROM check before it may measure. */
static uint8_t check_start(uint32_t now)
{
	uint8_t revision = read8(REGISTER_REVISION);
	if (revision == NO_REPLY || revision == HELD_LOW)
		return FAULT_NO_ANSWER;
	if (!(read8(REGISTER_STATUS) & STATUS_STARTING)) {
		if (!(read8(REGISTER_DATARD8) & EEPROM_OK))
			return FAULT_EEPROM;
		parts_found(DEVICE_PRESSURE, PART_SCP1000, revision);
		return measure(now);
	}
	return ticks_reached(now, deadline) ? FAULT_NEVER_STARTED : FAULT_NONE;
}

static uint8_t sample(uint32_t now, struct pressure_step *out)
{
	uint16_t temperature = read16(REGISTER_TEMPOUT) & TEMPERATURE_MASK;
	uint8_t high = read8(REGISTER_DATARD8);
	uint32_t pressure = (uint32_t)(high & PRESSURE_HIGH_MASK) << 16 | read16(REGISTER_DATARD16);
	if (high == NO_REPLY)
		return FAULT_NO_ANSWER;
	if (pressure == MSG_PRESSURE_PRESSURE_INVALID)
		return FAULT_BAD_VALUE;
	out->pressure = pressure;
	out->temperature = (int16_t)((int16_t)(temperature ^ TEMPERATURE_SIGN) - TEMPERATURE_SIGN);
	return await_sample(now);
}

static uint8_t poll(uint32_t now, struct pressure_step *out)
{
	if (spi_pressure_ready())
		return ticks_reached(now, earliest) ? sample(now, out) : FAULT_ALWAYS_READY;
	return ticks_reached(now, deadline) ? FAULT_NEVER_READY : FAULT_NONE;
}

void scp1000_run(uint32_t now, struct pressure_step *out)
{
	out->fault = measuring ? poll(now, out) : check_start(now);
}
