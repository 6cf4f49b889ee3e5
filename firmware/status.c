/* SPDX-License-Identifier: MIT */
#include "status.h"
#include <stddef.h> /* offsetof */

#define ERRORS offsetof(struct msg_status, errors_ranger_left)
#define FAULTS offsetof(struct msg_status, fault_ranger_left)
_Static_assert(offsetof(struct msg_status, errors_pressure) == ERRORS + 2 * DEVICE_PRESSURE, "in the devices' order");
_Static_assert(offsetof(struct msg_status, fault_pressure) == FAULTS + DEVICE_PRESSURE, "in the devices' order");

struct msg_status status;

void status_ok(enum device device)
{
	status.healthy = (uint8_t)(status.healthy | 1u << device);
}

void status_failed(enum device device, uint8_t fault)
{
	uint8_t *fields = (uint8_t *)&status;
	status.healthy = (uint8_t)(status.healthy & ~(1u << device));
	++((uint16_t *)(void *)(fields + ERRORS))[device];
	fields[FAULTS + device] = fault;
}
