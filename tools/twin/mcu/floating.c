/* SPDX-License-Identifier: GPL-3.0-or-later
 * Open inputs: what a pin reads that nothing drives. With its pull-up (20 to 50 kohm [ATmega32U4 data sheet, table
 * 29-1]) it reads one; without, it follows the mains hum that its wire picks up, if the fault `hum` plays any, else it
 * reads zero.
 *
 * D13 of a Micro is none of these: 1 kohm and a green LED to ground hold it at 1.8 to 2.4 V against the pull-up
 * [makers' netlists; computed], between the input's thresholds: it may read either, or change. On a Leonardo a buffer
 * is in between (`leonardo`). */
#include <simavr/sim_cycle_timers.h>

#include "twin.h"

static void changed(void *self, unsigned before)
{
	floating_resume();
}
FAULT_SWITCH(hum, "<=1000", changed, 0)

enum { ONES, ZEROS, NOISE, LEONARDO };
FAULT_SWITCH(d13_led, "ones zeros noise leonardo", changed, ONES)

static struct open_pin {
	char port;
	uint8_t pin;
	bool open;
} pins[] = { { 'D', 4, false }, { 'C', 7, false } };
static bool level;

static bool level_of(const struct open_pin *p)
{
	bool pulled_up = pin_is_pulled_up(p->port, p->pin);

	if (p->port == 'C' && d13_led.value != LEONARDO)
		return pulled_up && d13_led.value != ZEROS && (d13_led.value == ONES || random_below(2));
	return level || pulled_up;
}

static void follow(const struct open_pin *p)
{
	if (p->open && !pin_is_output(p->port, p->pin))
		set_pin(p->port, p->pin, level_of(p));
}

static avr_cycle_count_t swing(avr_t *a, avr_cycle_count_t when, void *param)
{
	level = !level;
	follow(&pins[0]);
	follow(&pins[1]);
	return when + US(500000) / hum.value;
}

void floating_pin(char port, uint8_t pin, bool open)
{
	for (int k = 0; k < 2; k++)
		if (pins[k].port == port && pins[k].pin == pin && open != pins[k].open) {
			pins[k].open = open;
			if (open)
				release_pin(port, pin);
			follow(&pins[k]);
		}
}

void floating_millisecond(void)
{
	if (d13_led.value != LEONARDO)
		follow(&pins[1]); /* at a write to the port simavr reads the pull-up alone */
}

/* After a reset of the processor simavr has lost the timer. */
void floating_resume(void)
{
	level = false;
	avr_cycle_timer_cancel(avr, swing, NULL);
	if (hum.value)
		avr_cycle_timer_register(avr, US(500000) / hum.value, swing, NULL);
	follow(&pins[0]);
	follow(&pins[1]);
}
