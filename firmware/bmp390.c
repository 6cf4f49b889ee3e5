/* SPDX-License-Identifier: MIT */
#include "bmp390.h"
#include <math.h>          /* ldexpf */
#include <string.h>        /* memcmp */
#include "board.h"         /* spi_* */
#include "configuration.h" /* mode */
#include "messages.h"      /* FAULT_* */
#include "parts.h"         /* what was found */

/* Registers, values and times [BST-BMP390-DS002, chapters 3 and 4]. */
#define REGISTER_CHIP_ID 0x00u
#define REGISTER_STATUS 0x03u
#define REGISTER_DATA 0x04u /* pressure, then temperature: 24 bits each, least byte first */
#define REGISTER_IF_CONF 0x1Au
#define REGISTER_PWR_CTRL 0x1Bu
#define REGISTER_OSR 0x1Cu
#define REGISTER_ODR 0x1Du
#define REGISTER_CONFIG 0x1Fu
#define REGISTER_CHECKSUM 0x30u /* then the coefficients */
#define REGISTER_CMD 0x7Eu
#define READ_FLAG 0x80u
#define CHIP_ID 0x60u
#define STATUS_PRESSURE_READY 0x20u
#define FOUR_WIRES 0x00u
#define PRESSURE_AND_TEMPERATURE_NORMAL 0x33u
#define SOFT_RESET 0xB6u
#define IIR_3 0x04u /* filter coefficient 3 */
/* Oversampling of pressure (bits 2:0) and of temperature (bits 5:3); rate 200 Hz / 2^n. A sample takes 37 and 70 ms. */
#define OSR_FAST 0x0Cu /* 16 and 2 */
#define ODR_FAST 0x04u /* 12.5 Hz */
#define OSR_SLOW 0x0Du /* 32 and 2 */
#define ODR_SLOW 0x06u /* 3.1 Hz */
#define UNMEASURED 0x800000u /* [4.3.4: value after a reset, and of a measurement that is switched off] */
#define NO_REPLY 0xFFu       /* MISO is pulled up: an absent chip reads as ones */

#define RESET_TICKS (10u * TICKS_PER_MS) /* start-up takes 2 ms */
/* the fast mode needs 80 ms per sample: one that is ready earlier is a stuck flag */
#define SAMPLE_MIN_TICKS (50u * TICKS_PER_MS)
#define SAMPLE_MAX_TICKS (2u * TICKS_PER_S)

#define COEFFICIENTS_SIZE 21u
#define TRIES 20u /* 0.1 s */
#define CRC_POLYNOMIAL 0x1Du /* of their checksum, from 0xFF on, inverted in the end [Bosch, bmp3_selftest.c] */
#define DATA_SIZE 6u
#define COUNTS_PER_PA 4.0f
#define COUNTS_PER_DEGREE 20.0f

static enum spi_protocol protocol; /* slow until the chip is known: an SCP1000 may be there */
static bool measuring;
static uint8_t tries; /* left, to read the coefficients */
static uint32_t earliest, deadline; /* of the next sample, ticks */
enum { T1, T2, T3, P1, P2, P3, P4, P5, P6, P7, P8, P9, P10, P11, PARAMETERS }; /* PAR_T1 ... PAR_P11 [8.4] */
#define OF_ONE_BYTE (1u << T3 | 1u << P3 | 1u << P4 | 1u << P7 | 1u << P8 | 1u << P10 | 1u << P11)
#define UNSIGNED (1u << T1 | 1u << T2 | 1u << P5 | 1u << P6)
#define WITH_OFFSET (1u << P1 | 1u << P2)
static float par[PARAMETERS];

/* The first byte of a reply is a dummy. */
static void read(uint8_t address, uint8_t *bytes, uint8_t length)
{
	(void)spi_begin(CHIP_PRESSURE, protocol, READ_FLAG | address);
	(void)spi_exchange(0);
	for (uint8_t n = 0; n < length; n++)
		bytes[n] = spi_exchange(0);
	spi_release();
}

static uint8_t read8(uint8_t address)
{
	uint8_t value;
	read(address, &value, 1);
	return value;
}

static void write8(uint8_t address, uint8_t value)
{
	spi_write(CHIP_PRESSURE, protocol, address, value);
}

/* An SCP1000 takes both reads for the same register, so that two different bytes are not from it. The write has no
 * effect on it. */
bool bmp390_answers(void)
{
	protocol = SPI_SCP1000;
	write8(REGISTER_IF_CONF, FOUR_WIRES);
	uint8_t identity = read8(REGISTER_CHIP_ID);
	bool answers = identity == CHIP_ID && read8(REGISTER_CHIP_ID + 1u) != CHIP_ID;
	bool unknown = parts_in(DEVICE_PRESSURE) == PART_NONE && identity != NO_REPLY;
	if (answers || unknown)
		parts_found(DEVICE_PRESSURE, answers ? PART_BMP390 : PART_NONE, identity);
	return answers;
}

uint32_t bmp390_start(uint32_t now)
{
	measuring = false;
	tries = TRIES;
	protocol = SPI_MODE3;
	write8(REGISTER_CMD, SOFT_RESET);
	return now + RESET_TICKS;
}

static uint8_t checksum(const uint8_t *bytes, uint8_t length)
{
	uint8_t crc = 0xFF;
	while (length--) {
		crc ^= *bytes++;
		for (uint8_t n = 0; n < 8; n++)
			crc = (uint8_t)((uint8_t)(crc << 1) ^ (crc >> 7) * CRC_POLYNOMIAL);
	}
	return (uint8_t)~crc;
}

/* The coefficients in their order and their scales [8.4]; false: their checksum is wrong. */
static bool read_coefficients(void)
{
	static const uint8_t powers[PARAMETERS] FLASH = { /* of two, negated */
		[T1] = (uint8_t)-8, [T2] = 30, [T3] = 48, [P1] = 20, [P2] = 29, [P3] = 32, [P4] = 37,
		[P5] = (uint8_t)-3, [P6] = 6, [P7] = 8, [P8] = 15, [P9] = 48, [P10] = 48, [P11] = 65,
	};
	uint8_t bytes[1 + COEFFICIENTS_SIZE];
	const uint8_t *next = bytes + 1;
	read(REGISTER_CHECKSUM, bytes, sizeof bytes);
	for (uint8_t k = 0; k < PARAMETERS; k++) {
		uint16_t bit = (uint16_t)(1u << k);
		int16_t word = (int8_t)*next++;
		if (!(bit & OF_ONE_BYTE))
			word = (int16_t)((uint8_t)word | (uint16_t)*next++ << 8);
		float value = (bit & UNSIGNED) ? (float)(uint16_t)word : (float)word;
		if (bit & WITH_OFFSET)
			value -= 0x1p14f;
		par[k] = ldexpf(value, -(int8_t)flash_byte(&powers[k]));
	}
	return bytes[0] == checksum(bytes + 1, COEFFICIENTS_SIZE);
}

/* Temperature in degC [8.5]. */
static float temperature_of(uint32_t raw)
{
	float d = (float)raw - par[T1];
	return d * par[T2] + d * d * par[T3];
}

/* Pressure in Pa at temperature t [8.6]; 24-bit mantissas cost up to 0.1 Pa. */
static float pressure_of(uint32_t raw, float t)
{
	float r = (float)raw;
	float offset = par[P5] + t * (par[P6] + t * (par[P7] + t * par[P8]));
	float slope = par[P1] + t * (par[P2] + t * (par[P3] + t * par[P4]));
	return offset + r * (slope + r * (par[P9] + t * par[P10] + r * par[P11]));
}

static void await_sample(uint32_t now)
{
	earliest = now + SAMPLE_MIN_TICKS;
	deadline = now + SAMPLE_MAX_TICKS;
}

/* Writes the settings, or reads them back; true: none differs. */
static bool go_through_settings(bool writes)
{
	static const uint8_t settings[][3] FLASH = { /* register, value in the fast mode, in the slow one */
		{ REGISTER_OSR, OSR_FAST, OSR_SLOW },
		{ REGISTER_ODR, ODR_FAST, ODR_SLOW },
		{ REGISTER_CONFIG, IIR_3, IIR_3 },
		{ REGISTER_PWR_CTRL, PRESSURE_AND_TEMPERATURE_NORMAL, PRESSURE_AND_TEMPERATURE_NORMAL },
	};
	uint8_t mode = configuration.pressure_mode == PRESSURE_MODE_HIGH_RESOLUTION ? 2 : 1;
	bool equal = true;
	for (uint8_t n = 0; n < sizeof settings / sizeof *settings; n++) {
		uint8_t address = flash_byte(&settings[n][0]), value = flash_byte(&settings[n][mode]);
		if (writes)
			write8(address, value);
		else
			equal = read8(address) == value && equal;
	}
	return equal;
}

static uint8_t measure(uint32_t now)
{
	if (read8(REGISTER_CHIP_ID) != CHIP_ID)
		return FAULT_NO_ANSWER;
	if (!read_coefficients())
		return --tries ? FAULT_NONE : FAULT_EEPROM;
	(void)go_through_settings(true);
	measuring = true;
	await_sample(now);
	return FAULT_NONE;
}

static uint32_t raw_of(const uint8_t *bytes)
{
	return (uint32_t)bytes[2] << 16 | (uint16_t)((uint16_t)bytes[1] << 8 | bytes[0]);
}

static uint8_t convert(const uint8_t *d, struct pressure_step *out)
{
	uint32_t raw_pressure = raw_of(d), raw_temperature = raw_of(d + 3);
	if (raw_pressure == UNMEASURED || raw_temperature == UNMEASURED)
		return FAULT_BAD_VALUE;
	float t = temperature_of(raw_temperature), pa = pressure_of(raw_pressure, t);
	if (!(pa >= 30000.0f && pa <= 125000.0f && t >= -40.0f && t <= 85.0f)) /* measuring range [1] */
		return FAULT_BAD_VALUE;
	out->pressure = (uint32_t)(pa * COUNTS_PER_PA + 0.5f);
	out->temperature = (int16_t)(t * COUNTS_PER_DEGREE);
	return FAULT_NONE;
}

/* A sample has no checksum: it is read twice. Settings may have arrived with a wrong bit: they are read back, and
 * written anew. */
static uint8_t sample(uint32_t now, struct pressure_step *out)
{
	uint8_t d[2][DATA_SIZE];
	read(REGISTER_DATA, d[0], DATA_SIZE);
	read(REGISTER_DATA, d[1], DATA_SIZE);
	bool equal = memcmp(d[0], d[1], DATA_SIZE) == 0, set = go_through_settings(false);
	out->wrong_bits = !equal || !set;
	if (!set)
		(void)go_through_settings(true);
	await_sample(now);
	return equal ? convert(d[0], out) : FAULT_NONE;
}

static uint8_t poll(uint32_t now, struct pressure_step *out)
{
	uint8_t flags = read8(REGISTER_STATUS);
	bool ready = flags & read8(REGISTER_STATUS) & STATUS_PRESSURE_READY; /* one of them may have a wrong bit */
	if (flags == NO_REPLY)
		return FAULT_NO_ANSWER;
	if (ready)
		return ticks_reached(now, earliest) ? sample(now, out) : FAULT_ALWAYS_READY;
	return ticks_reached(now, deadline) ? FAULT_NEVER_READY : FAULT_NONE;
}

void bmp390_run(uint32_t now, struct pressure_step *out)
{
	out->fault = measuring ? poll(now, out) : measure(now);
}
