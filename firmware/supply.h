/* SPDX-License-Identifier: MIT */
/* Supply voltage of the board. */
#ifndef ECHOSTEP_SUPPLY_H
#define ECHOSTEP_SUPPLY_H

#include <stdint.h>

/* Takes the measurement that is finished, and starts the next one. */
void supply_run(void);

/* Newest voltage, and the least since the previous call, in mV; MSG_BOARD_HEALTH_INVALID: not measured. */
void supply_take(uint16_t *newest_mv, uint16_t *least_mv);

#endif
