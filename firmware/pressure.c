/* SPDX-License-Identifier: MIT */
#include "pressure.h"
#include "board.h"         /* spi_* */
#include "configuration.h" /* mode, whether it is enabled */
#include "link.h"          /* sending the messages */
#include "status.h"        /* error counter */

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
#define STARTING_POLL_TICKS (10u * TICKS_PER_MS)
#define READY_POLL_TICKS (5u * TICKS_PER_MS)
#define SAMPLE_MIN_TICKS (50u * TICKS_PER_MS) /* the fast mode needs 110 ms per sample: an earlier DRDY is a stuck line */
#define SAMPLE_MAX_TICKS (2u * TICKS_PER_S)   /* the slow mode needs 560 ms per sample */
#define RETRY_TICKS TICKS_PER_S               /* from a failure to the next reset */

enum stage { STARTING, MEASURING, FAILED };

static enum stage stage;
/* Times in ticks of the board's clock. */
static uint32_t due;      /* next step */
static uint32_t earliest; /* DRDY before this time is an error */
static uint32_t deadline; /* of the start, or of the next sample */

static uint8_t read8(uint8_t address)
{
	spi_select(CHIP_PRESSURE);
	(void)spi_exchange((uint8_t)(address << 2));
	uint8_t value = spi_exchange(0);
	spi_release();
	return value;
}

static uint16_t read16(uint8_t address)
{
	spi_select(CHIP_PRESSURE);
	(void)spi_exchange((uint8_t)(address << 2));
	uint8_t high = spi_exchange(0), low = spi_exchange(0);
	spi_release();
	return (uint16_t)((uint16_t)(high << 8) | low);
}

static void write8(uint8_t address, uint8_t value)
{
	spi_select(CHIP_PRESSURE);
	(void)spi_exchange((uint8_t)((unsigned)address << 2 | WRITE_FLAG));
	(void)spi_exchange(value);
	spi_release();
}

static void wait(enum stage next, uint32_t until)
{
	stage = next;
	due = until;
}

/* Counts the failure; the chip is reset again after RETRY_TICKS. */
static void fail(uint32_t now, uint8_t fault)
{
	status_failed(DEVICE_PRESSURE, fault);
	wait(FAILED, now + RETRY_TICKS);
}

void pressure_start(uint32_t now)
{
	write8(REGISTER_OPERATION, OPERATION_STOP); /* after a reset of the board alone the chip is still measuring */
	write8(REGISTER_RESET, 1);
	deadline = now + RESET_TICKS + STARTING_MAX_TICKS;
	wait(STARTING, now + RESET_TICKS);
}

static void await_sample(uint32_t now)
{
	earliest = now + SAMPLE_MIN_TICKS;
	deadline = now + SAMPLE_MAX_TICKS;
	wait(MEASURING, now + READY_POLL_TICKS);
}

static void measure(uint32_t now)
{
	bool slow = configuration.pressure_mode == PRESSURE_MODE_HIGH_RESOLUTION;
	write8(REGISTER_OPERATION, slow ? OPERATION_HIGH_RESOLUTION : OPERATION_HIGH_SPEED);
	await_sample(now);
}

/* Polls the start: a chip that answers has left STARTING and passed its EEPROM check before it may measure. */
static void check_start(uint32_t now)
{
	uint8_t revision = read8(REGISTER_REVISION);
	if (revision == NO_REPLY || revision == HELD_LOW) {
		fail(now, FAULT_NO_ANSWER);
	} else if (!(read8(REGISTER_STATUS) & STATUS_STARTING)) {
		if (read8(REGISTER_DATARD8) & EEPROM_OK)
			measure(now);
		else
			fail(now, FAULT_EEPROM);
	} else if (ticks_reached(now, deadline)) {
		fail(now, FAULT_NEVER_STARTED);
	} else {
		due = now + STARTING_POLL_TICKS;
	}
}

static void sample(uint32_t now)
{
	struct msg_pressure m = { .ticks = now };
	uint16_t temperature = read16(REGISTER_TEMPOUT) & TEMPERATURE_MASK;
	uint8_t high = read8(REGISTER_DATARD8);
	m.pressure = (uint32_t)(high & PRESSURE_HIGH_MASK) << 16 | read16(REGISTER_DATARD16);
	m.temperature = (int16_t)((int16_t)(temperature ^ TEMPERATURE_SIGN) - TEMPERATURE_SIGN);
	if (high == NO_REPLY) {
		fail(now, FAULT_NO_ANSWER);
		return;
	}
	if (m.pressure == MSG_PRESSURE_PRESSURE_INVALID) {
		fail(now, FAULT_BAD_VALUE);
		return;
	}
	status_ok(DEVICE_PRESSURE);
	link_send(MSG_PRESSURE, msg_pack_pressure(link_body(), &m));
	await_sample(now);
}

static void check_sample(uint32_t now)
{
	bool ready = spi_pressure_ready();
	if (ready && ticks_reached(now, earliest))
		sample(now);
	else if (ready || ticks_reached(now, deadline))
		fail(now, ready ? FAULT_ALWAYS_READY : FAULT_NEVER_READY);
	else
		due = now + READY_POLL_TICKS;
}

uint32_t pressure_run(uint32_t now)
{
	if (!configuration_reads(SENSORS_PRESSURE))
		due = now + RETRY_TICKS;
	if (!ticks_reached(now, due))
		return due;
	if (stage == STARTING)
		check_start(now);
	else if (stage == MEASURING)
		check_sample(now);
	else
		pressure_start(now);
	return due;
}
