/* The two SRF02 ultrasonic rangers: when they fire, and what they heard, as `ping` messages.
 * Owns the ping schedule. Both schedules share one grid: each ranger has a slot every period, the right one half a period after
 * the left one.
 *   concurrent: period 66 ms, plus a pseudo-random delay of up to 4.1 ms on every trigger, so that an echo of the other
 *               ranger's ping moves by a known amount from ping to ping while one's own stays.
 *   sequential: period 140 ms, no delay, and a ranger waits until the other one has been read [Girard 2011, section 2]. */
#ifndef ECHOSTEP_RANGER_H
#define ECHOSTEP_RANGER_H

#include <stdbool.h>
#include <stdint.h>

/* Lays the grid anew, first slot in 100 ms; a ping under way is still read. */
void ranger_start(uint32_t now);

/* Fires and reads what is due; returns when to call again, unless an interrupt calls earlier. */
uint32_t ranger_run(uint32_t now);

/* Whether no trigger is due within the next millisecond: the time a transfer of somebody else may take. */
bool ranger_quiet(uint32_t now);

#endif
