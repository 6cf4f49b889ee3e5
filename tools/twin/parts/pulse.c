/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two pulse rangers of the kind of RCWL-1601 and HC-SR04P [HC-SR04 user guide].
 *
 * A trigger of at least 10 us starts a burst; the echo line rises at its end and falls with the first echo, or after 38 ms without one.
 * Triggers are wired to PF5 and PF4, echo lines to PD4 and PC7 (left, right). The echo is of the own burst, or of the other ranger's. */
#include <string.h>

#include <simavr/avr_ioport.h>
#include <simavr/sim_cycle_timers.h>

#include "twin.h"

#define TRIGGER_LEAST US(10)
#define BURST_US 450u   /* from the end of the trigger to the rising edge, 8 cycles of 40 kHz and the module's own program */
#define SPREAD_US 30u   /* random part of it */
#define BLANKED_US 116u /* 2 cm, out and back */
#define WINDOW_US 26200u /* 4.5 m */
#define NO_ECHO_US 38000u
#define GLITCH US(3000)
#define HELD_US 70000u /* measured at HC-SR04 modules [forum.arduino.cc 613370: "approximately 70000"] */
#define LONG_US 200000u /* some modules hold the line so long */

static struct ranger {
	const char *name;
	enum place place;
	char echo_port, echo_pin;
	enum fault { GOOD, ABSENT, STUCK_LOW, STUCK_HIGH, DEAF, HELD, LONG, FAULTS } fault;
	bool trigger, line;
	avr_cycle_count_t triggered_at;
	struct bursts bursts;
} rangers[2] = {
	{ .name = "left", .place = PLACE_RANGER_LEFT, .echo_port = 'D', .echo_pin = 4 },
	{ .name = "right", .place = PLACE_RANGER_RIGHT, .echo_port = 'C', .echo_pin = 7 },
};
static const char *const fault_names[FAULTS] = { "ok", "absent", "stuck_low", "stuck_high", "deaf", "held", "long" };

static bool is_here(const struct ranger *r)
{
	return kit_of_2026(r->place) && r->fault != ABSENT;
}

/* Without a module the line is open, but for the left one's where SyncOut's buffer or a foot's part drives it. */
static void set_line(struct ranger *r, bool level)
{
	r->line = level;
	if (is_here(r))
		drive_pin(r->echo_port, (uint8_t)r->echo_pin, r->fault != STUCK_LOW && (level || r->fault == STUCK_HIGH));
	else if (r->place == PLACE_RANGER_RIGHT || !(kit_of_papers(r->place) || kit_has_foot()))
		floating_pin(r->echo_port, (uint8_t)r->echo_pin, true);
}

static avr_cycle_count_t fall(avr_t *a, avr_cycle_count_t when, void *param)
{
	(void)a;
	(void)when;
	set_line(param, false);
	return 0;
}

/* A burst of the other ranger that begins while this one listens is not heard: a shortcut, it would arrive behind most own echoes. */
static avr_cycle_count_t rise(avr_t *a, avr_cycle_count_t when, void *param)
{
	struct ranger *r = param;

	const struct ranger *other = &rangers[r == rangers];
	uint32_t us = r->fault == DEAF ? 0 : bursts_first_echo(&other->bursts, when, row.own_us[r - rangers], BLANKED_US, WINDOW_US);

	bursts_add(&r->bursts, when, row.cross_us[r == rangers]);
	if (!us)
		us = r->fault == LONG ? LONG_US : r->fault == HELD ? HELD_US : NO_ECHO_US;
	set_line(r, true);
	bench_trace("trigger %s", r->name);
	avr_cycle_timer_register(a, US(us), fall, r);
	return 0;
}

static void trigger_changed(struct avr_irq_t *irq, uint32_t level, void *param)
{
	struct ranger *r = param;
	bool was = r->trigger;

	(void)irq;
	level = level && !jtag_owns_analog_pins();
	r->trigger = level;
	if (level && !was)
		r->triggered_at = avr->cycle;
	if (level || !was || r->line || !is_here(r))
		return;
	if (avr->cycle - r->triggered_at < TRIGGER_LEAST) {
		bench_trace("pulse %s trigger too short", r->name);
		return;
	}
	avr_cycle_timer_cancel(avr, rise, r);
	avr_cycle_timer_register(avr, US(BURST_US + random_below(SPREAD_US)), rise, r);
}

static void power(struct ranger *r)
{
	avr_cycle_timer_cancel(avr, rise, r);
	avr_cycle_timer_cancel(avr, fall, r);
	r->bursts = (struct bursts){ 0 };
	set_line(r, false);
}

void pulse_power(void)
{
	static bool wired;

	for (int k = 0; !wired && k < 2; k++)
		avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('F'), 5 - k), trigger_changed, &rangers[k]);
	wired = true;
	for (int k = 0; k < 2; k++)
		power(&rangers[k]);
}

/* After a reset of the processor simavr has lost the timers: a ping under way is over. */
void pulse_resume(void)
{
	pulse_power();
}

static avr_cycle_count_t glitch_ends(avr_t *a, avr_cycle_count_t when, void *param)
{
	struct ranger *r = param;

	(void)a;
	(void)when;
	if (!r->line)
		drive_pin(r->echo_port, (uint8_t)r->echo_pin, false);
	set_line(r, r->line);
	return 0;
}

/* A disturbance of an echo line that is low, or of SyncOut: high for 3 ms. */
bool pulse_glitch(const char *value)
{
	for (int k = 0; k < 2; k++)
		if (!strcmp(value, rangers[k].name)) {
			if (!rangers[k].line) {
				drive_pin(rangers[k].echo_port, (uint8_t)rangers[k].echo_pin, true);
				avr_cycle_timer_register(avr, GLITCH, glitch_ends, &rangers[k]);
			}
			return true;
		}
	return false;
}

bool pulse_fault(const char *name, const char *value)
{
	if (strncmp(name, "pulse_", 6))
		return false;
	for (int k = 0; k < 2; k++)
		for (int f = 0; !strcmp(name + 6, rangers[k].name) && f < FAULTS; f++)
			if (!strcmp(value, fault_names[f])) {
				rangers[k].fault = (enum fault)f;
				set_line(&rangers[k], rangers[k].line);
				return true;
			}
	return false;
}
