/* SPDX-License-Identifier: MIT */
#include "status.h"
#include <stddef.h> /* offsetof */
#include "board.h"  /* tables in flash */

struct msg_status status;

/* Where its fields are in `status`. */
static const uint8_t errors_at[] FLASH = {
	[DEVICE_RANGER_LEFT] = offsetof(struct msg_status, errors_ranger_left),
	[DEVICE_RANGER_RIGHT] = offsetof(struct msg_status, errors_ranger_right),
	[DEVICE_COMPASS] = offsetof(struct msg_status, errors_compass),
	[DEVICE_THIGH] = offsetof(struct msg_status, errors_thigh),
	[DEVICE_CALF] = offsetof(struct msg_status, errors_calf),
	[DEVICE_BELT] = offsetof(struct msg_status, errors_belt),
	[DEVICE_PRESSURE] = offsetof(struct msg_status, errors_pressure),
};
static const uint8_t fault_at[] FLASH = {
	[DEVICE_RANGER_LEFT] = offsetof(struct msg_status, fault_ranger_left),
	[DEVICE_RANGER_RIGHT] = offsetof(struct msg_status, fault_ranger_right),
	[DEVICE_COMPASS] = offsetof(struct msg_status, fault_compass),
	[DEVICE_THIGH] = offsetof(struct msg_status, fault_thigh),
	[DEVICE_CALF] = offsetof(struct msg_status, fault_calf),
	[DEVICE_BELT] = offsetof(struct msg_status, fault_belt),
	[DEVICE_PRESSURE] = offsetof(struct msg_status, fault_pressure),
};

void status_ok(enum device device)
{
	status.healthy = (uint8_t)(status.healthy | 1u << device);
}

void status_failed(enum device device, uint8_t fault)
{
	status.healthy = (uint8_t)(status.healthy & ~(1u << device));
	uint8_t *fields = (uint8_t *)&status;
	++*(uint16_t *)(void *)(fields + flash_byte(&errors_at[device]));
	fields[flash_byte(&fault_at[device])] = fault;
}
