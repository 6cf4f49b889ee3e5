#include "status.h"

struct msg_status status;

void status_ok(uint8_t healthy_flag)
{
	status.healthy = (uint8_t)(status.healthy | healthy_flag);
}

void status_failed(uint8_t healthy_flag, uint16_t *errors)
{
	status.healthy = (uint8_t)(status.healthy & ~healthy_flag);
	++*errors;
}
