/* SPDX-License-Identifier: GPL-3.0-or-later
 * Open inputs: what a pin reads that nothing drives. With its pull-up (20 to 50 kohm [ATmega32U4 data sheet, table 29-1]) it reads one; without,
 * it follows the mains hum that its wire picks up, if the fault `hum` plays any, else it reads zero. */
#include <stdlib.h>

#include <simavr/avr_ioport.h>
#include <simavr/sim_cycle_timers.h>

#include "twin.h"

#define PINS 2

static struct open_pin {
	char port;
	uint8_t pin;
	bool open;
} pins[PINS] = { { 'D', 4, false }, { 'C', 7, false } };
static unsigned hum_hertz;
static bool level;

static void follow(const struct open_pin *p)
{
	if (p->open && !pin_is_output(p->port, p->pin))
		avr_raise_irq(avr_io_getirq(avr, (uint32_t)AVR_IOCTL_IOPORT_GETIRQ(p->port), p->pin), pin_is_pulled_up(p->port, p->pin) || level);
}

static avr_cycle_count_t swing(avr_t *a, avr_cycle_count_t when, void *param)
{
	(void)a;
	(void)param;
	if (!hum_hertz)
		return 0;
	level = !level;
	for (int k = 0; k < PINS; k++)
		follow(&pins[k]);
	return when + US(500000) / hum_hertz;
}

void floating_pin(char port, uint8_t pin, bool open)
{
	for (int k = 0; k < PINS; k++)
		if (pins[k].port == port && pins[k].pin == pin && open != pins[k].open) {
			pins[k].open = open;
			if (open)
				release_pin(port, pin);
			follow(&pins[k]);
		}
}

/* After a reset of the processor simavr has lost the timer. */
void floating_resume(void)
{
	level = false;
	avr_cycle_timer_cancel(avr, swing, NULL);
	if (hum_hertz)
		avr_cycle_timer_register(avr, US(500000) / hum_hertz, swing, NULL);
	for (int k = 0; k < PINS; k++)
		follow(&pins[k]);
}

bool floating_hum(const char *value)
{
	char *end;
	long hertz = strtol(value, &end, 10);

	if (end == value || *end || hertz < 0 || hertz > 1000)
		return false;
	hum_hertz = (unsigned)hertz;
	floating_resume();
	return true;
}
