/* SPDX-License-Identifier: MIT */
/* The settings in force: the defaults after a reset, then what the host's last `configure` set. */
#ifndef ECHOSTEP_CONFIGURATION_H
#define ECHOSTEP_CONFIGURATION_H

#include <stdbool.h>
#include "messages.h" /* struct msg_configure */

/* Defaults: all sensors, concurrent pings, gyros at 200 Hz, compass at 10 Hz, fast pressure. Only configuration_set
 * writes it. */
extern struct msg_configure configuration;

/* Puts the wanted settings into force, each value clamped to its range. */
void configuration_set(const struct msg_configure *wanted);

/* Whether any of these sensors (SENSORS_* flags) is to be read. */
bool configuration_reads(uint8_t sensors);

#endif
