/* The settings in force. They start at the defaults and last until the next reset. */
#ifndef ECHOSTEP_CONFIGURATION_H
#define ECHOSTEP_CONFIGURATION_H

#include <stdbool.h>
#include "messages.h"

#define GYRO_RATE_MIN_HZ 10u
#define GYRO_RATE_MAX_HZ 200u
#define COMPASS_RATE_MIN_HZ 1u
#define COMPASS_RATE_MAX_HZ 20u

/* All sensors, concurrent pings, gyros at 200 Hz, compass at 10 Hz, fast pressure; written by configuration_set alone. */
extern struct msg_configure configuration;

/* Takes the wanted settings, every value clamped into its range. */
void configuration_set(const struct msg_configure *wanted);

/* Whether any of these sensors (SENSORS_* flags) is to be read. */
bool configuration_reads(uint8_t sensors);

#endif
