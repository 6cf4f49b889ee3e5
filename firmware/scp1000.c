#include "scp1000.h"
#include "board.h"
#include "configuration.h"
#include "link.h"
#include "status.h"

/* Registers and the start-up sequence [SCP1000-D01 datasheet]. */
#define REGISTER_REVISION 0x00u /* never all zeros or ones */
#define REGISTER_OPERATION 0x03u
#define REGISTER_RESET 0x06u
#define REGISTER_STATUS 0x07u
#define REGISTER_DATARD8 0x1Fu  /* after the start: EEPROM check; then pressure, bits 18:16 */
#define REGISTER_DATARD16 0x20u /* pressure, bits 15:0; reading it takes DRDY back */
#define REGISTER_TEMPOUT 0x21u
#define WRITE_FLAG 0x02u
#define STATUS_STARTING 0x01u
#define EEPROM_OK 0x01u
#define OPERATION_STOP 0x00u
#define OPERATION_HIGH_SPEED 0x09u
#define OPERATION_HIGH_RESOLUTION 0x0Au
#define PRESSURE_HIGH_MASK 0x07u
#define NOBODY 0xFFu /* what an empty bus reads */
#define HELD_LOW 0x00u
#define TEMPERATURE_MASK 0x3FFFu
#define TEMPERATURE_SIGN 0x2000

#define RESET_TICKS (60u * TICKS_PER_MS)
#define STARTING_MAX_TICKS (150u * TICKS_PER_MS)
#define STARTING_POLL_TICKS (10u * TICKS_PER_MS)
#define READY_POLL_TICKS (5u * TICKS_PER_MS)
#define SAMPLE_MIN_TICKS (50u * TICKS_PER_MS)    /* the fast mode gives one in 110 ms: DRDY before that is a stuck line */
#define SAMPLE_MAX_TICKS (2u * TICKS_PER_S)   /* the slow mode gives one in 560 ms */
#define RETRY_TICKS TICKS_PER_S

enum stage { STARTING, MEASURING, FAILED };

static enum stage stage;
static uint32_t due;
static uint32_t earliest; /* a sample before that cannot be one */
static uint32_t deadline; /* by which the chip must have started, or given the next sample */

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

static void fail(uint32_t now, uint8_t fault)
{
	status_failed(DEVICE_PRESSURE, fault);
	wait(FAILED, now + RETRY_TICKS);
}

void pressure_start(uint32_t now)
{
	write8(REGISTER_OPERATION, OPERATION_STOP); /* a board that restarts may find it measuring */
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

static void check_start(uint32_t now)
{
	uint8_t revision = read8(REGISTER_REVISION);
	if (revision == NOBODY || revision == HELD_LOW) {
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
	if (high == NOBODY) {
		fail(now, FAULT_NO_ANSWER);
		return;
	}
	if (m.pressure == 0) {
		fail(now, FAULT_BAD_VALUE);
		return;
	}
	status_ok(DEVICE_PRESSURE);
	link_send(MSG_PRESSURE, pack_pressure(link_body(), &m));
	await_sample(now);
}

static void check_sample(uint32_t now)
{
	bool ready = pressure_ready();
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
