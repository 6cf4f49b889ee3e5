/* SPDX-License-Identifier: MIT */
#include "pulse.h"
#include "board.h" /* capture_* */
#include "parts.h" /* what was found */

/* [HC-SR04 user guide: a pulse of 150 us to 25 ms, or of 38 ms without an echo; a new ping every 60 ms. RCWL-1601: the same at 3 to 5 V.
 * Modules with 70 and 200 ms without an echo have been measured.] The JSN-SR04T answers only 12 ms after its trigger. */
#define ANSWER_MAX_TICKS (20u * TICKS_PER_MS)         /* from the trigger to the rising edge */
#define ECHO_MAX_TICKS (53u * TICKS_PER_MS / 2u)      /* 4.5 m, out and back: a longer pulse is one without an echo */
#define TICKS_PER_US 2u
#define GHOST_MAX_US 700u /* 12 cm: many modules answer the ping after one without an echo with 4 to 9 cm [forum.arduino.cc 429576, 337199] */
#define POLL_TICKS TICKS_PER_MS

bool pulse_begin(uint8_t side, struct ranging *r)
{
	r->due = r->trigger; /* when the trigger pulse was sent */
	return capture_trigger(side);
}

/* A rising edge is an answer, whatever becomes of the pulse. What really is so near is heard again by the next ping. */
static enum ranging_state finish(uint8_t side, uint32_t length, struct ranging *r)
{
	static bool silent[2];
	uint16_t us = length > ECHO_MAX_TICKS ? 0 : (uint16_t)(length / TICKS_PER_US);
	r->time_of_flight_us = silent[side] && us < GHOST_MAX_US ? 0 : us;
	silent[side] = us == 0;
	parts_found(side, PART_PULSE, 0);
	return RANGING_DONE;
}

enum ranging_state pulse_run(uint8_t side, uint32_t now, struct ranging *r)
{
	struct capture_pulse pulse;
	enum capture_state state = capture_take_pulse(side, &pulse);
	uint32_t elapsed = now - r->due;
	if (state != CAPTURE_WAITING)
		r->trigger = pulse.rise;
	r->next = now + POLL_TICKS;
	if (state == CAPTURE_OVER)
		return finish(side, pulse.fall - pulse.rise, r);
	if (state == CAPTURE_WAITING && elapsed > ANSWER_MAX_TICKS) {
		capture_end_pulse(side);
		return RANGING_REFUSED;
	}
	if (state == CAPTURE_HIGH && ticks_reached(now, pulse.rise + ECHO_MAX_TICKS + TICKS_PER_US)) {
		capture_end_pulse(side);
		return finish(side, now - pulse.rise, r);
	}
	return RANGING_BUSY;
}
