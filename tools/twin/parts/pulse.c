/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two pulse rangers of the kind of RCWL-1601 and HC-SR04P [HC-SR04 user guide].
 *
 * A trigger of at least 50 us starts a burst; the echo line rises at its end and falls with the first echo, or after 38
 * ms without one. Triggers are wired to PF5 and PF4, echo lines to PD4 and PC7 (left, right). The echo is of the own
 * burst, or of the other ranger's. */
#include <simavr/avr_ioport.h>
#include <simavr/sim_cycle_timers.h>

#include "parts/parts.h"

#define TRIGGER_LEAST US(50) /* of an RCWL-1655; most are content with 10 us */
/* from the end of the trigger to the rising edge, 8 cycles of 40 kHz and the module's own program */
#define BURST_US 450u
#define SPREAD_US 30u   /* random part of it */
#define NO_ECHO_US 38000u
#define GLITCH US(3000)
#define HELD_US 70000u /* measured at HC-SR04 modules [forum.arduino.cc 613370: "approximately 70000"] */
#define LONG_US 200000u /* some modules hold the line so long */
#define LOOK US(50)
#define GHOST_US 467u /* 8 cm in the ping after one without an echo [forum.arduino.cc 429576, 337199] */

/* NO_TIMEOUT: without an echo the line stays high until it is pulled low from outside [NewPing; HC-SR04P:
 * fossasia/pslab-python 209]; ENDLESS: even then. */
enum { STUCK_LOW = OTHER_FAULTS, STUCK_HIGH, UNECHOED, HELD, LONG, NO_TIMEOUT, ENDLESS, GHOST };

static struct pulse_ranger {
	struct part part;
	char echo_port;
	uint8_t echo_pin;
	bool trigger, line;
	bool unheard; /* its last ping had no echo */
	avr_cycle_count_t triggered_at;
	struct bursts bursts;
} rangers[] = {
	{ .part = PART(pulse, PLACE_RANGER_LEFT, "pulse_left"), .echo_port = 'D', .echo_pin = 4 },
	{ .part = PART(pulse, PLACE_RANGER_RIGHT, "pulse_right"), .echo_port = 'C', .echo_pin = 7 },
};

/* Without a module the line is open, but for the left one's where SyncOut's buffer or a foot's part drives it. */
static void set_line(struct pulse_ranger *r, bool level)
{
	unsigned fault = r->part.fault.value;
	enum place place = r->part.place;

	r->line = level;
	if (part_is_here(&r->part))
		drive_pin(r->echo_port, r->echo_pin, fault != STUCK_LOW && (level || fault == STUCK_HIGH));
	else if (place == PLACE_RANGER_RIGHT || !(place_has(place, OF_PAPERS) || place_has(PLACE_FOOT, OF_FOOT)))
		floating_pin(r->echo_port, r->echo_pin, true);
}

static avr_cycle_count_t fall(avr_t *a, avr_cycle_count_t when, void *param)
{
	set_line(param, false);
	return 0;
}

/* Until the line falls, without an echo. */
static uint32_t longest_us(unsigned fault)
{
	return fault == LONG ? LONG_US : fault == HELD ? HELD_US : NO_ECHO_US;
}

/* Looks whether the processor pulls its line low. */
static avr_cycle_count_t wait_for_ever(avr_t *a, avr_cycle_count_t when, void *param)
{
	struct pulse_ranger *r = param;

	if (r->part.fault.value == NO_TIMEOUT && !pin_is_low_output(r->echo_port, r->echo_pin))
		return when + LOOK;
	if (r->part.fault.value != ENDLESS)
		set_line(r, false);
	return r->part.fault.value == ENDLESS ? when + LOOK : 0;
}

/* A burst of the other ranger that begins while this one listens is not heard: a shortcut, it would arrive behind most
 * own echoes. */
static avr_cycle_count_t rise(avr_t *a, avr_cycle_count_t when, void *param)
{
	struct pulse_ranger *r = param;
	unsigned side = r != rangers, fault = r->part.fault.value;
	uint32_t us = bursts_first_echo(&pulse, &rangers[!side].bursts, when, input.row.own_us[side]);

	set_line(r, true);
	bursts_add(&pulse, &r->bursts, side, when);
	if (fault == GHOST && r->unheard)
		us = GHOST_US;
	r->unheard = !us;
	if (!us && fault >= NO_TIMEOUT && fault <= ENDLESS)
		avr_cycle_timer_register(a, LOOK, wait_for_ever, r);
	else
		avr_cycle_timer_register(a, US(us && fault != UNECHOED ? us : longest_us(fault)), fall, r);
	return 0;
}

static void trigger_changed(struct avr_irq_t *irq, uint32_t level, void *param)
{
	struct pulse_ranger *r = param;
	bool was = r->trigger;

	r->trigger = level && !jtag_owns_analog_pins();
	if (r->trigger && !was)
		r->triggered_at = avr->cycle;
	if (r->trigger || !was || r->line || !part_is_here(&r->part))
		return;
	if (avr->cycle - r->triggered_at < TRIGGER_LEAST)
		bench_trace("pulse %s trigger too short", sides[r != rangers]);
	else
		avr_cycle_timer_register(avr, US(BURST_US + random_below(SPREAD_US)), rise, r);
}

static void wire(void *self)
{
	avr_irq_t *pin = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('F'), self == rangers ? 5 : 4);

	avr_irq_register_notify(pin, trigger_changed, self);
}

/* A ping under way is over. */
static void power(void *self)
{
	struct pulse_ranger *r = self;

	avr_cycle_timer_cancel(avr, rise, r);
	avr_cycle_timer_cancel(avr, fall, r);
	avr_cycle_timer_cancel(avr, wait_for_ever, r);
	r->bursts = (struct bursts){ 0 };
	set_line(r, false);
}

static avr_cycle_count_t glitch_ends(avr_t *a, avr_cycle_count_t when, void *param)
{
	struct pulse_ranger *r = param;

	if (!r->line)
		drive_pin(r->echo_port, r->echo_pin, false);
	set_line(r, r->line);
	return 0;
}

static void disturb(void *self, unsigned before)
{
	struct pulse_ranger *r = &rangers[((struct fault_switch *)self)->value];

	if (r->line)
		return;
	drive_pin(r->echo_port, r->echo_pin, true);
	avr_cycle_timer_register(avr, GLITCH, glitch_ends, r);
}
FAULT_SWITCH(glitch, "left right", disturb, 0)

static void changed(void *self, unsigned before)
{
	struct pulse_ranger *r = self;

	set_line(r, r->line);
}

const struct model pulse = {
	.kind = OF_2026,
	.faults = "ok absent stuck_low stuck_high deaf held long no_timeout endless ghost",
	PARTS(rangers),
	.wire = wire,
	.power = power,
	.resume = power, /* simavr has lost its timers */
	.changed = changed,
	.least_us = 116,    /* 2 cm, out and back */
	.window_us = 26200, /* 4.5 m */
};
