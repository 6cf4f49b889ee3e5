/* SPDX-License-Identifier: MIT */
#include "pulse.h"
#include "board.h" /* capture_* */
#include "parts.h" /* what was found */

/* [HC-SR04 user guide: a pulse of 150 us to 25 ms, or of 38 ms without an echo; a new ping every 60 ms. RCWL-1601: the
 * same at 3 to 5 V. Modules with 70 and 200 ms without an echo have been measured.] The JSN-SR04T answers only 12 ms
 * after its trigger. */
#define ANSWER_MIN_TICKS (TICKS_PER_MS / 10u)         /* from the trigger to the rising edge */
#define ANSWER_MAX_TICKS (15u * TICKS_PER_MS)
#define PROOFS 8u                              /* answers in a row by which a module is known, each within */
#define SPREAD_TICKS (3u * TICKS_PER_MS / 10u) /* of the first */
#define ECHO_MAX_TICKS (53u * TICKS_PER_MS / 2u)      /* 4.5 m, out and back: a longer pulse is one without an echo */
#define TICKS_PER_US 2u
/* 12 cm: many modules answer the ping after one without an echo with 4 to 9 cm [forum.arduino.cc 429576, 337199] */
#define GHOST_MAX_US 700u
#define POLL_TICKS TICKS_PER_MS

static uint16_t firsts[2]; /* ticks from trigger to answer, of the first of these: */
static uint8_t proofs[2];  /* answers in a row that agree */

bool pulse_begin(uint8_t side, struct ranging *r)
{
	r->due = r->trigger; /* when the trigger pulse was sent */
	return capture_trigger(side);
}

/* Whether answers come so evenly after their triggers as those of a module: edges on an open line do not. `delay`: of
 * this one. */
static bool prove(uint8_t side, uint16_t delay, uint8_t *fault)
{
	uint16_t off = (uint16_t)(delay - firsts[side] + SPREAD_TICKS);
	bool agrees = proofs[side] == 0 || proofs[side] >= PROOFS || off <= 2u * SPREAD_TICKS;
	if (proofs[side] == 0 || !agrees) {
		firsts[side] = delay;
		proofs[side] = 0;
	}
	if (delay >= ANSWER_MIN_TICKS)
		proofs[side]++;
	if (agrees)
		*fault = FAULT_NONE;
	if (proofs[side] < PROOFS)
		return false;
	proofs[side] = 2u * PROOFS;
	return true;
}

bool pulse_was_heard(uint8_t side)
{
	return proofs[side] != 0;
}

/* A module that was known has eight slots before it must prove itself anew. */
static void note_silence(uint8_t side)
{
	proofs[side] = proofs[side] > PROOFS ? (uint8_t)(proofs[side] - 1u) : 0;
}

/* A rising edge is an answer, whatever becomes of the pulse. What really is so near is heard again by the next ping. */
static enum ranging_state finish(uint8_t side, uint32_t length, struct ranging *r)
{
	static bool silent[2];
	uint16_t us = length > ECHO_MAX_TICKS ? 0 : (uint16_t)(length / TICKS_PER_US);
	r->time_of_flight_us = silent[side] && us < GHOST_MAX_US ? 0 : us;
	silent[side] = us == 0;
	if (!prove(side, (uint16_t)(r->trigger - r->due), &r->fault))
		return RANGING_REFUSED;
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
		note_silence(side);
		return RANGING_REFUSED;
	}
	if (state == CAPTURE_HIGH && ticks_reached(now, pulse.rise + ECHO_MAX_TICKS + TICKS_PER_US)) {
		capture_end_pulse(side);
		return finish(side, now - pulse.rise, r);
	}
	return RANGING_BUSY;
}
