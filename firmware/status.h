/* What was lost and what is wrong, counted where it happens and sent once a second. */
#ifndef ECHOSTEP_STATUS_H
#define ECHOSTEP_STATUS_H

#include "messages.h"

/* Each counter is written by one module: dropped_* by link, errors_* and healthy through the two functions below. */
extern struct msg_status status;

/* A device answered properly; `healthy_flag` is its HEALTHY_*. */
void status_ok(uint8_t healthy_flag);

/* A device failed; `errors` is its counter in `status`. */
void status_failed(uint8_t healthy_flag, uint16_t *errors);

#endif
