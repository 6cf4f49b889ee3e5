/* SPDX-License-Identifier: MIT */
/* The motion sensor of a foot: finds it at the thigh's chip select. A board that has found one is a foot board, until
 * its next start: it switches all other sensors off, and the pulses on the SyncOut pin are the part's data-ready. One
 * `foot` message per sample. */
#ifndef ECHOSTEP_FOOT_H
#define ECHOSTEP_FOOT_H

#include <stdbool.h>
#include <stdint.h>
#include "board.h" /* struct capture_edge */

/* Before the first foot_run. */
void foot_start(uint32_t now);

/* Seeks, starts or watches the part when that is due (0.1 ms); true: it was found for the first time, and the
 * configuration has changed. */
bool foot_run(uint32_t now);

/* Reads and sends the sample of a data-ready edge (0.1 ms); false: this is no foot board, the edge is not the
 * part's. */
bool foot_take(const struct capture_edge *edge);

/* Whether this is no foot board, or its part has samples. */
bool foot_is_well(void);

/* Sends `foot_health`, if this is a foot board. */
void foot_send_health(void);

#endif
