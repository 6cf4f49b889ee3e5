/* SPDX-License-Identifier: MIT */
/* Pulse rangers (RCWL-1601, HC-SR04P): a pulse on the trigger line starts a ping; the echo line is high from the burst
 * to its echo. */
#ifndef ECHOSTEP_PULSE_H
#define ECHOSTEP_PULSE_H

#include "ranger.h" /* struct ranging */

/* Sends a trigger pulse (60 us), at r->trigger; false: the echo line is high, or another device drives it. */
bool pulse_begin(uint8_t side, struct ranging *r);

/* Looks for the two edges of the answer; a pulse that is longer than any echo ends the ranging while its line is still
 * high. RANGING_REFUSED: no answer, or not yet eight alike. */
enum ranging_state pulse_run(uint8_t side, uint32_t now, struct ranging *r);

/* Whether the last ping was answered, as far as is known by a module. */
bool pulse_was_heard(uint8_t side);

#endif
