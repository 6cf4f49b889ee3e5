/* SPDX-License-Identifier: MIT */
#include "configuration.h"
#include "compass.h" /* limits of its rate */
#include "gyros.h"   /* limits of their rate */
#include "parts.h"   /* a foot board has no other sensors */

struct msg_configure configuration = {
	.sensors = 0xFF,
	.schedule = SCHEDULE_CONCURRENT,
	.gyro_rate_hz = GYROS_RATE_MAX_HZ,
	.compass_rate_hz = 10,
	.pressure_mode = PRESSURE_MODE_HIGH_SPEED,
};

static uint8_t clamp(uint8_t value, uint8_t low, uint8_t high)
{
	if (value < low)
		return low;
	return value > high ? high : value;
}

void configuration_set(const struct msg_configure *wanted)
{
	configuration = *wanted;
	if (parts_in(PLACE_FOOT) == PART_ICM20649)
		configuration.sensors = 0;
	configuration.schedule = clamp(wanted->schedule, SCHEDULE_CONCURRENT, SCHEDULE_SIMULTANEOUS);
	configuration.gyro_rate_hz = clamp(wanted->gyro_rate_hz, GYROS_RATE_MIN_HZ, GYROS_RATE_MAX_HZ);
	configuration.compass_rate_hz = clamp(wanted->compass_rate_hz, COMPASS_RATE_MIN_HZ, COMPASS_RATE_MAX_HZ);
	configuration.pressure_mode = clamp(wanted->pressure_mode, PRESSURE_MODE_HIGH_SPEED, PRESSURE_MODE_HIGH_RESOLUTION);
}

bool configuration_reads(uint8_t sensors)
{
	return (configuration.sensors & sensors) != 0;
}
