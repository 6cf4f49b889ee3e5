/* What was lost and what is wrong, counted where it happens and sent once a second. */
#ifndef ECHOSTEP_STATUS_H
#define ECHOSTEP_STATUS_H

#include "messages.h"

/* Each counter is written by one module: dropped_* by link, errors_*, fault_* and healthy through the two functions below. */
extern struct msg_status status;

/* In the order of the bits of `healthy`. */
enum device { DEVICE_RANGER_LEFT, DEVICE_RANGER_RIGHT, DEVICE_COMPASS, DEVICE_THIGH, DEVICE_CALF, DEVICE_BELT, DEVICE_PRESSURE };

/* A device answered properly. */
void status_ok(enum device device);

/* A device failed, and how: FAULT_*. */
void status_failed(enum device device, uint8_t fault);

#endif
