/* SPDX-License-Identifier: MIT */
/* The two ultrasonic rangers: finds which kind is wired, triggers and reads them, one `ping` message per ranging cycle.
 * Owns the ping schedule. All share one grid: each ranger has one slot per period, the right ranger half a period after
 * the left one, or at the same time.
 *   concurrent: period 66 ms, or of slower SRF02 2 ms more than their measured cycle, plus a pseudo-random delay of up
 *               to 4.1 ms on every trigger. From ping to ping, an echo of the other ranger's ping moves by a known
 *               amount; an own echo does not.
 *   sequential: period 140 ms, no delay, and a ranger waits until the other one has been read [Girard 2011, section 2].
 *   simultaneous: period as concurrent, no delay; a first echo is then of the same burst, on either side.
 * With a MaxSonar the periods are 100 ms and 200 ms. Both rangers must be of one kind: with two kinds, one beam and one
 * range would be right for one side only. */
#ifndef ECHOSTEP_RANGER_H
#define ECHOSTEP_RANGER_H

#include <stdint.h>
#include "board.h" /* struct twi_transfer */

/* Starts a new grid, first slot in 100 ms; a ping under way is still read. */
void ranger_start(uint32_t now);

/* Triggers and reads what is due; returns the time of the next call, unless an interrupt comes earlier. */
uint32_t ranger_run(uint32_t now);

/* Measured cycle of SRF02 in ticks, which the schedule follows; 0: of none. */
uint32_t ranger_cycle(void);

/* For the drivers. A side is RANGER_LEFT or RANGER_RIGHT, which are also its `enum device`. */
enum ranging_state {
	RANGING_BUSY,
	RANGING_DONE,
	RANGING_REFUSED, /* the ranger has not accepted the trigger: it is busy or absent */
	RANGING_FAILED,
};

/* One ranging cycle, begun and advanced by the driver of the ranger's kind. */
struct ranging {
	struct twi_transfer transfer; /* the driver's, as are the next two: */
	uint8_t stage;
	uint32_t due;               /* of its next step */
	uint32_t trigger;           /* time of the ping, ticks */
	uint32_t next;              /* of the driver's next call, unless an interrupt comes earlier */
	uint16_t time_of_flight_us; /* 0: no echo */
	uint8_t fault;              /* FAULT_*, of RANGING_FAILED and of RANGING_REFUSED */
};

#define RANGER_IDLE_TICKS (30u * TICKS_PER_MS) /* until the next call of a driver that waits for an interrupt */

#endif
