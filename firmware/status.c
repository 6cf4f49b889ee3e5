/* SPDX-License-Identifier: MIT */
#include "status.h"

struct msg_status status;

static const struct {
	uint16_t *errors;
	uint8_t *fault;
} counters[] = {
	[DEVICE_RANGER_LEFT] = { &status.errors_ranger_left, &status.fault_ranger_left },
	[DEVICE_RANGER_RIGHT] = { &status.errors_ranger_right, &status.fault_ranger_right },
	[DEVICE_COMPASS] = { &status.errors_compass, &status.fault_compass },
	[DEVICE_THIGH] = { &status.errors_thigh, &status.fault_thigh },
	[DEVICE_CALF] = { &status.errors_calf, &status.fault_calf },
	[DEVICE_BELT] = { &status.errors_belt, &status.fault_belt },
	[DEVICE_PRESSURE] = { &status.errors_pressure, &status.fault_pressure },
};

void status_ok(enum device device)
{
	status.healthy = (uint8_t)(status.healthy | 1u << device);
}

void status_failed(enum device device, uint8_t fault)
{
	status.healthy = (uint8_t)(status.healthy & ~(1u << device));
	++*counters[device].errors;
	*counters[device].fault = fault;
}
