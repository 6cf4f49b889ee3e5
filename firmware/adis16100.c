#include "adis16100.h"
#include "board.h"
#include "configuration.h"
#include "link.h"
#include "selftest.h"
#include "status.h"

/* [ADIS16100 datasheet] WRITE, a channel, normal power, two's complement. The reply belongs to the frame before: its channel
 * stands in bits 13:12, its value in bits 11:0. */
#define COMMAND_RATE 0x8300u
#define COMMAND_TEMPERATURE 0x8700u
#define CHANNEL_RATE 0x0000u
#define CHANNEL_TEMPERATURE 0x1000u
#define CHANNEL_MASK 0xF000u /* both leading zeros and the channel */
#define NOBODY 0xFFFFu       /* what an empty bus reads */
#define VALUE_MASK 0x0FFFu
#define SIGN_BIT 0x0800

#define INVALID INT16_MIN

static const struct {
	enum chip chip;
	enum device device;
	uint8_t sensor;
} devices[GYROS] = {
	[GYRO_THIGH] = { CHIP_THIGH, DEVICE_THIGH, SENSORS_THIGH },
	[GYRO_CALF] = { CHIP_CALF, DEVICE_CALF, SENSORS_CALF },
	[GYRO_BELT] = { CHIP_BELT, DEVICE_BELT, SENSORS_BELT },
};

static uint32_t due;
static uint32_t health_due;
static uint32_t period;

void gyros_start(uint32_t now)
{
	due = now;
	period = TICKS_PER_S / configuration.gyro_rate_hz;
}

static uint16_t exchange(enum chip chip, uint16_t command)
{
	spi_select(chip);
	uint8_t high = spi_exchange((uint8_t)(command >> 8));
	uint8_t low = spi_exchange((uint8_t)(command & 0xFFu));
	spi_release();
	return (uint16_t)((uint16_t)(high << 8) | low);
}

static int16_t value_of(uint8_t gyro, uint16_t reply, uint16_t channel)
{
	if ((reply & CHANNEL_MASK) != channel) {
		status_failed(devices[gyro].device, reply == NOBODY ? FAULT_NO_ANSWER : FAULT_WRONG_CHANNEL);
		return INVALID;
	}
	status_ok(devices[gyro].device);
	return (int16_t)((int16_t)((reply & VALUE_MASK) ^ SIGN_BIT) - SIGN_BIT);
}

static int16_t rate(uint8_t gyro)
{
	if (!configuration_reads(devices[gyro].sensor))
		return INVALID;
	return value_of(gyro, exchange(devices[gyro].chip, COMMAND_RATE), CHANNEL_RATE);
}

/* Whatever a chip converted last is a whole period old: a first round of frames makes all three convert now. */
static void convert(void)
{
	for (uint8_t k = 0; k < GYROS; k++)
		(void)exchange(devices[k].chip, COMMAND_RATE);
}

static void sample(void)
{
	convert();
	struct msg_gyros m = { clock_now(), INVALID, INVALID, INVALID };
	const int16_t rates[GYROS] = { rate(GYRO_THIGH), rate(GYRO_CALF), rate(GYRO_BELT) };
	if (selftest_running()) {
		selftest_take(rates);
	} else {
		m.thigh = rates[GYRO_THIGH];
		m.calf = rates[GYRO_CALF];
		m.belt = rates[GYRO_BELT];
	}
	link_send(MSG_GYROS, pack_gyros(link_body(), &m));
}

/* Asked for by one frame, converted by the next, which asks for the rate again. */
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
		const struct verdict *v = selftest_verdict(k);
		int16_t counts = temperature(k);
		struct msg_gyro_health m = { clock_now(), k, counts, v->outcome, v->response[0], v->response[1] };
		link_send(MSG_GYRO_HEALTH, pack_gyro_health(link_body(), &m));
	}
}

uint32_t gyros_run(uint32_t now)
{
	uint32_t step = selftest_running() ? TICKS_PER_S / GYRO_RATE_MAX_HZ : period;
	if (!ticks_reached(now, due))
		return due;
	if (configuration_reads(SENSORS_THIGH | SENSORS_CALF | SENSORS_BELT))
		sample();
	if (ticks_reached(now, health_due)) {
		report_health();
		health_due = now + TICKS_PER_S;
	}
	due += step;
	if (ticks_reached(now, due)) /* held up for longer than a period: no burst of samples afterwards */
		due = now + step;
	return due;
}
