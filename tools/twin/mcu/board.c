/* SPDX-License-Identifier: GPL-3.0-or-later
 * Power, supply voltage and resets of the board, and what the bootloader Caterina does after a reset.
 *
 * Caterina [its source, Arduino 1.8] clears MCUSR and its key, starts the program at once after a loss of power, or
 * after a watchdog reset without the key, and else waits for 8 s as another USB device. Then it detaches, leaves the
 * controller on, and jumps to the program.
 *
 * What it leaves [Caterina.c, StartSketch and SetupHardware; Caterina.h of the boards Leonardo and Micro]: the LEDs of
 * PB0 and PD5 off, so with a one in their ports; after a wait, those pins and PC7 are outputs, and Timer1, which ran
 * with a falling edge for its capture, has left its flags. */
#include <string.h>

#include "twin.h"

enum { MCUSR = 0x54, USBCON = 0xD8, USBE = 0x80 };
enum { DDRB = 0x24, PORTB, DDRC = 0x27, PORTC, DDRD = 0x2A, PORTD, RX_LED = 0x01, L_LED = 0x80, TX_LED = 0x20 };

#define BOOTLOADER_MS 8000u
#define BOOTLOADER_DATA 0x100 /* its variables: 256 bytes or less */
#define BOOTLOADER_DATA_SIZE 0x100
#define BOOTLOADER_STACK 0x80
#define KEY 0x7777u
#define KEY_ADDRESS_OLD 0x800 /* the key's place differs between versions; here both are cleared */
#define REFERENCE_MV 1100
#define REFERENCE_SPREAD_MV 33 /* 3 %, from chip to chip; the data sheet allows 9 % */
#define MEMORY_MV 1300         /* below it, memory is lost and the next reset is one of power-on */
#define CHIPS_MV 3000          /* below it, the sensors start anew */
/* below it, a processor at 16 MHz hangs; an example of what may happen below the specified 4500 */
#define RELIABLE_MV 3600
#define BROWN_OUT_HYSTERESIS_MV 50

static void supply_changed(void *self, unsigned before);
FAULT_SWITCH(supply, "<=6000", supply_changed, 5000)
FAULT_SWITCH(brown_out_fuse, "0 2600 4300", NULL, 1) /* of the boards as sold */
FAULT_SWITCH(bootloader, "none caterina", NULL, 1)
FAULT_SWITCH(echo_resistor, "none 1000", NULL, 1) /* in series in both Echo, as wired in firmware/hardware */

static bool plugged = true, in_brown_out, memory_lost, chips_lost;
static uint8_t next_cause = POWER_ON;
static unsigned bootloader_ms; /* left */
static bool led_shorted;

static void fill(unsigned from, unsigned size)
{
	memset(avr->data + from, 0xA5, size);
}

static const char *name_of(uint8_t cause)
{
	return cause & POWER_ON ? "power" : cause & WATCHDOG ? "watchdog" : cause & BROWN_OUT ? "brown_out" : "external";
}

static bool take_key(unsigned address)
{
	bool found = avr->data[address] == (KEY & 0xFF) && avr->data[address + 1] == KEY >> 8;

	avr->data[address] = avr->data[address + 1] = 0;
	return found;
}

/* true: the bootloader waits before it starts the program. */
static bool bootloader_stays(uint8_t cause)
{
	bool old = take_key(KEY_ADDRESS_OLD);
	bool key = take_key(avr->ramend - 1u) || old;

	fill(BOOTLOADER_DATA, BOOTLOADER_DATA_SIZE);
	fill(avr->ramend + 1u - BOOTLOADER_STACK, BOOTLOADER_STACK - 2u);
	avr->data[MCUSR] = 0;
	return (cause & EXTERNAL) || !((cause & POWER_ON) || ((cause & WATCHDOG) && !key));
}

/* The processor's registers are at their reset values, and simavr has lost all timers. */
static void start_program(void)
{
	usb_device_reset();
	twi_reset();
	spi_reset();
	parts_resume();
	floating_resume();
	usb_host_start();
}

static void after_reset(avr_t *a)
{
	uint8_t cause = next_cause;

	hang_end();
	chip_reset();
	led_shorted = false;
	if (memory_lost || (cause & POWER_ON)) {
		fill(avr->ioend + 1u, (unsigned)(avr->ramend - avr->ioend)); /* what is in RAM is undefined */
		cause = POWER_ON;
	}
	if (chips_lost || (cause & POWER_ON))
		parts_power();
	memory_lost = chips_lost = false;
	a->data[MCUSR] = cause;
	bench_trace("reset %s", name_of(cause));
	bench_sync(false); /* simavr has lost the timer of its pulse */
	bootloader_ms = bootloader.value && bootloader_stays(cause) ? BOOTLOADER_MS : 0;
	if (bootloader.value) {
		a->data[PORTB] |= RX_LED;
		a->data[PORTD] |= TX_LED;
	}
	if (bootloader_ms)
		bench_trace("bootloader waits");
	start_program();
	if (bootloader_ms)
		usb_host_unplug();
}

static void drive_leds(void)
{
	avr->data[DDRB] |= RX_LED;
	avr->data[DDRC] |= L_LED;
	avr->data[DDRD] |= TX_LED;
}

bool has_series_resistor(char port, uint8_t pin)
{
	return echo_resistor.value && ((port == 'C' && pin == 7) || (port == 'D' && pin == 4));
}

/* While the bootloader waits, its LED breathes: PC7 is driven high and low by turns, against what drives the right echo
 * line. */
static void breathe(void)
{
	bool level = bootloader_ms & 1;

	drive_leds();
	avr->data[PORTC] = (uint8_t)((avr->data[PORTC] & ~L_LED) | (level ? L_LED : 0));
	if (echo_resistor.value || led_shorted || !pin_is_held('C', 7, !level))
		return;
	led_shorted = true;
	bench_trace("contention on PC7, by the bootloader");
}

void board_reset(uint8_t cause)
{
	next_cause = cause;
	avr_reset(avr);
}

static void end_bootloader(void)
{
	start_program();
	avr->data[USBCON] |= USBE; /* the bootloader leaves the controller on, detached */
	avr->data[PORTC] &= (uint8_t)~L_LED;
	drive_leds();
	timer_flags_left_over();
	bench_trace("program starts");
}

/* The lamp of RX, which a Micro lights by a one and a Leonardo by a zero [Caterina.h;
 * variants/micro/pins_arduino.h]. */
static void watch_lamp(void)
{
	static bool was;
	bool level = pin_is_output('B', 0) && !pin_is_low_output('B', 0);

	if (level != was)
		bench_trace("lamp %u", level);
	was = level;
}

bool board_runs(void)
{
	if (bootloader_ms && plugged && !in_brown_out && --bootloader_ms == 0)
		end_bootloader();
	if (bootloader_ms && plugged)
		breathe();
	if (!plugged || in_brown_out || bootloader_ms)
		return false;
	if (supply.value < RELIABLE_MV)
		hang_now();
	hang_millisecond();
	watch_lamp();
	return true;
}

/* The converter measures the reference against the supply; simavr knows the reference only as 1100 mV. */
static void apply_supply(void)
{
	static unsigned reference_mv;

	if (!reference_mv)
		reference_mv = REFERENCE_MV - REFERENCE_SPREAD_MV + (unsigned)(random_state % (2 * REFERENCE_SPREAD_MV + 1));
	avr->vcc = avr->avcc = supply.value * REFERENCE_MV / reference_mv;
}

static void supply_changed(void *self, unsigned before)
{
	static const unsigned brown_outs_mv[] = { 0, 2600, 4300 };
	unsigned mv = supply.value, brown_out_mv = brown_outs_mv[brown_out_fuse.value];

	memory_lost |= mv < MEMORY_MV;
	chips_lost |= mv < CHIPS_MV;
	bench_trace("supply %u", mv);
	if (mv < brown_out_mv || mv < MEMORY_MV) {
		in_brown_out = true;
		usb_host_unplug();
	} else if (in_brown_out && mv >= brown_out_mv + BROWN_OUT_HYSTERESIS_MV) {
		in_brown_out = false;
		board_reset(BROWN_OUT);
	}
	apply_supply();
}

void board_power(bool on)
{
	if (on == plugged)
		return;
	plugged = on;
	usb_host_unplug();
	if (pty_wanted())
		(on ? pty_open : pty_close)();
	if (on)
		board_reset(POWER_ON);
}

static void reset_by(void *self, unsigned before)
{
	static const uint8_t causes[] = { WATCHDOG, POWER_ON, EXTERNAL };
	uint8_t cause = causes[((struct fault_switch *)self)->value];

	if (cause == WATCHDOG)
		hang_soon(); /* the program's own watchdog does the rest */
	else
		board_reset(cause);
}
FAULT_SWITCH(reset, "watchdog power external", reset_by, 0)

void board_init(void)
{
	apply_supply();
	parts_init();
	avr->reset = after_reset;
	after_reset(avr);
}
