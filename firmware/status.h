/* SPDX-License-Identifier: MIT */
/* Counters of lost frames, failures and causes: each is counted where it happens; all are sent once a second as
 * `status`. */
#ifndef ECHOSTEP_STATUS_H
#define ECHOSTEP_STATUS_H

#include "messages.h" /* struct msg_status */

/* Who writes: dropped_* link, and main for sync; bad_frames link and main; bus_recoveries, ticks and memory_used main;
 * errors_*, fault_* and healthy the two functions below. */
extern struct msg_status status;

/* In the order of the bits of `healthy`, which also are the first bits of the configuration's `sensors`. */
enum device {
	DEVICE_RANGER_LEFT, DEVICE_RANGER_RIGHT, DEVICE_COMPASS, DEVICE_THIGH, DEVICE_CALF, DEVICE_BELT, DEVICE_PRESSURE,
};

/* The device gave a proper answer. */
void status_ok(enum device device);

/* The device failed; `fault` is the cause, FAULT_*. */
void status_failed(enum device device, uint8_t fault);

#endif
