/* SPDX-License-Identifier: MIT */
#include "gyros.h"
#include "board.h"         /* clock_now, spi_* */
#include "configuration.h" /* rate, enabled gyros */
#include "link.h"          /* sending the messages */
#include "parts.h"         /* what was found */
#include "selftest.h"      /* receives the rates while a self-test runs */
#include "status.h"        /* error counters */

/* Command bits [ADIS16100 datasheet]: WRITE, a channel, normal power, two's complement. Each 16-bit frame returns the reply to the
 * previous frame: channel in bits 13:12, value in bits 11:0. */
#define COMMAND_RATE 0x8300u
#define COMMAND_TEMPERATURE 0x8700u
#define CHANNEL_RATE 0x0000u
#define CHANNEL_TEMPERATURE 0x1000u
#define CHANNEL_MASK 0xF000u /* both leading zeros and the channel */
#define NO_REPLY 0xFFFFu     /* MISO is pulled up: an absent chip reads as ones */
#define VALUE_MASK 0x0FFFu
#define SIGN_BIT 0x0800

static const struct {
	enum chip chip;
	enum device device;
	uint8_t sensor;
} devices[GYROS] = {
	[GYRO_THIGH] = { CHIP_THIGH, DEVICE_THIGH, SENSORS_THIGH },
	[GYRO_CALF] = { CHIP_CALF, DEVICE_CALF, SENSORS_CALF },
	[GYRO_BELT] = { CHIP_BELT, DEVICE_BELT, SENSORS_BELT },
};

/* Times in ticks of the board's clock. */
static uint32_t due;        /* next sample */
static uint32_t health_due; /* next `gyro_health` messages */
static uint32_t period;     /* between samples */

void gyros_start(uint32_t now)
{
	due = now;
	period = TICKS_PER_S / configuration.gyro_rate_hz;
}

/* One frame: sends `command`, returns the reply to the previous frame. */
static uint16_t exchange(enum chip chip, uint16_t command)
{
	spi_select(chip, SPI_ADIS16100);
	uint8_t high = spi_exchange((uint8_t)(command >> 8));
	uint8_t low = spi_exchange((uint8_t)(command & 0xFFu));
	spi_release();
	return (uint16_t)((uint16_t)(high << 8) | low);
}

/* Counts of a reply; MSG_GYROS_INVALID, and an error in `status`, when it names another channel. */
static int16_t value_of(uint8_t gyro, uint16_t reply, uint16_t channel)
{
	if ((reply & CHANNEL_MASK) != channel) {
		status_failed(devices[gyro].device, reply == NO_REPLY ? FAULT_NO_ANSWER : FAULT_WRONG_CHANNEL);
		return MSG_GYROS_INVALID;
	}
	status_ok(devices[gyro].device);
	return (int16_t)((int16_t)((reply & VALUE_MASK) ^ SIGN_BIT) - SIGN_BIT);
}

static int16_t rate(uint8_t gyro)
{
	if (!configuration_reads(devices[gyro].sensor))
		return MSG_GYROS_INVALID;
	return value_of(gyro, exchange(devices[gyro].chip, COMMAND_RATE), CHANNEL_RATE);
}

/* First round of frames: makes all three chips convert now. The values of their previous conversion are a whole period old. */
static void convert(void)
{
	for (uint8_t k = 0; k < GYROS; k++)
		(void)exchange(devices[k].chip, COMMAND_RATE);
}

static void sample(void)
{
	convert();
	struct msg_gyros m = { clock_now(), MSG_GYROS_INVALID, MSG_GYROS_INVALID, MSG_GYROS_INVALID };
	const int16_t rates[GYROS] = { rate(GYRO_THIGH), rate(GYRO_CALF), rate(GYRO_BELT) };
	if (selftest_running()) {
		selftest_add_rates(rates);
	} else {
		m.thigh = rates[GYRO_THIGH];
		m.calf = rates[GYRO_CALF];
		m.belt = rates[GYRO_BELT];
	}
	link_send(MSG_GYROS, msg_pack_gyros(link_body(), &m));
}

/* One frame requests the temperature; the next frame returns it and requests the rate again. */
static int16_t temperature(uint8_t gyro)
{
	(void)exchange(devices[gyro].chip, COMMAND_TEMPERATURE);
	return value_of(gyro, exchange(devices[gyro].chip, COMMAND_RATE), CHANNEL_TEMPERATURE);
}

static void report_health(void)
{
	for (uint8_t k = 0; k < GYROS; k++) {
		if (!configuration_reads(devices[k].sensor))
			continue;
		const struct selftest_result *test = selftest_result(k);
		int16_t counts = temperature(k);
		if (counts != MSG_GYRO_HEALTH_INVALID)
			parts_found(devices[k].device, PART_ADIS16100, 0);
		struct msg_gyro_health m = { clock_now(), k, counts, test->outcome, test->response[0], test->response[1] };
		link_send(MSG_GYRO_HEALTH, msg_pack_gyro_health(link_body(), &m));
	}
}

uint32_t gyros_run(uint32_t now)
{
	uint32_t step = selftest_running() ? TICKS_PER_S / GYROS_RATE_MAX_HZ : period;
	if (!ticks_reached(now, due))
		return due;
	if (configuration_reads(SENSORS_THIGH | SENSORS_CALF | SENSORS_BELT))
		sample();
	if (ticks_reached(now, health_due)) {
		report_health();
		health_due = now + TICKS_PER_S;
	}
	due += step;
	if (ticks_reached(now, due)) /* late by more than one step: skip samples instead of sending a burst */
		due = now + step;
	return due;
}
