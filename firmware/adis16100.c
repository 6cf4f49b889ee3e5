#include "adis16100.h"
#include "board.h"
#include "configuration.h"
#include "link.h"
#include "status.h"

/* [ADIS16100 datasheet] WRITE, gyro channel, normal power, two's complement. The reply belongs to the frame before: its channel
 * stands in bits 13:12, its value in bits 11:0. */
#define COMMAND_HIGH 0x83u
#define COMMAND_LOW 0x00u
#define CHANNEL_MASK 0xF000u /* both leading zeros and the gyro's channel, 0; an empty bus reads ones */
#define VALUE_MASK 0x0FFFu
#define SIGN_BIT 0x0800

#define INVALID INT16_MIN

static uint32_t due;
static uint32_t period;

void gyros_start(uint32_t now)
{
	due = now;
	period = TICKS_PER_S / configuration.gyro_rate_hz;
}

static uint16_t exchange(enum chip chip)
{
	spi_select(chip);
	uint8_t high = spi_exchange(COMMAND_HIGH);
	uint8_t low = spi_exchange(COMMAND_LOW);
	spi_release();
	return (uint16_t)((uint16_t)(high << 8) | low);
}

static int16_t read(enum chip chip, uint8_t sensor, uint8_t healthy_flag, uint16_t *errors)
{
	if (!configuration_reads(sensor))
		return INVALID;
	uint16_t reply = exchange(chip);
	if (reply & CHANNEL_MASK) {
		status_failed(healthy_flag, errors);
		return INVALID;
	}
	status_ok(healthy_flag);
	return (int16_t)((int16_t)((reply & VALUE_MASK) ^ SIGN_BIT) - SIGN_BIT);
}

/* Whatever a chip converted last is a whole period old: a first round of frames makes all three convert now. */
static void convert(void)
{
	(void)exchange(CHIP_THIGH);
	(void)exchange(CHIP_CALF);
	(void)exchange(CHIP_BELT);
}

static void sample(void)
{
	convert();
	struct msg_gyros m = { .ticks = clock_now() };
	m.thigh = read(CHIP_THIGH, SENSORS_THIGH, HEALTHY_THIGH, &status.errors_thigh);
	m.calf = read(CHIP_CALF, SENSORS_CALF, HEALTHY_CALF, &status.errors_calf);
	m.belt = read(CHIP_BELT, SENSORS_BELT, HEALTHY_BELT, &status.errors_belt);
	link_send(MSG_GYROS, pack_gyros(link_body(), &m));
}

uint32_t gyros_run(uint32_t now)
{
	if (!ticks_reached(now, due))
		return due;
	if (configuration_reads(SENSORS_THIGH | SENSORS_CALF | SENSORS_BELT))
		sample();
	due += period;
	if (ticks_reached(now, due)) /* held up for longer than a period: no burst of samples afterwards */
		due = now + period;
	return due;
}
