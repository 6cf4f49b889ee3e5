/* SPDX-License-Identifier: MIT */
/* What the board can tell of its wiring without a meter: how often each input was high. One `electrical` message a
 * second. */
#ifndef ECHOSTEP_ELECTRICAL_H
#define ECHOSTEP_ELECTRICAL_H

/* Reads the inputs; called in each turn of the main loop. */
void electrical_run(void);

/* Sends the counts, and begins anew. */
void electrical_send(void);

#endif
