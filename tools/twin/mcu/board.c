/* SPDX-License-Identifier: GPL-3.0-or-later
 * Power and resets of the board, and what the bootloader Caterina does after a reset.
 *
 * Caterina [its source, Arduino 1.8] clears MCUSR and its key, starts the program at once after a loss of power, or after a watchdog reset
 * without the key, and else waits for 8 s as another USB device. Then it detaches, leaves the controller on, and jumps to the program.
 *
 * What it leaves [Caterina.c, StartSketch and SetupHardware; Caterina.h of the boards Leonardo and Micro]: the LEDs of PB0 and PD5 off, so with a
 * one in their ports; after a wait, those pins and PC7 are outputs, and Timer1, which ran with a falling edge for its capture, has left its flags. */
#include <string.h>

#include "twin.h"

enum { MCUSR = 0x54, USBCON = 0xD8, USBE = 0x80 };
enum { DDRB = 0x24, PORTB, DDRC = 0x27, PORTC, DDRD = 0x2A, PORTD, RX_LED = 0x01, L_LED = 0x80, TX_LED = 0x20 };
enum { POWER_ON = 1, EXTERNAL = 2, BROWN_OUT = 4, WATCHDOG = 8 };

#define BOOTLOADER_MS 8000u
#define BOOTLOADER_DATA 0x100 /* its variables: 256 bytes or less */
#define BOOTLOADER_DATA_SIZE 0x100
#define BOOTLOADER_STACK 0x80
#define KEY 0x7777u
#define KEY_ADDRESS_OLD 0x800 /* the key's place differs between versions; here both are cleared */

static bool with_bootloader = true, plugged = true;
static uint8_t next_cause = POWER_ON;
static unsigned bootloader_ms; /* left */
static bool echo_resistor = true; /* in series in ECHO_R, as wired in firmware/hardware */
static bool led_shorted;

static void power_devices(void)
{
	srf02_power();
	adis16100_power();
	scp1000_power();
	compass_power();
	bmp390_power();
	lis3mdl_power();
	lsm6dso_power();
	pulse_power();
	maxsonar_power();
	icm20649_power();
}

static void fill(unsigned from, unsigned size)
{
	memset(avr->data + from, 0xA5, size);
}

/* The content of RAM after power-up is undefined. */
static void scramble_memory(void)
{
	fill(avr->ioend + 1u, (unsigned)(avr->ramend - avr->ioend));
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
	scp1000_resume();
	bmp390_resume();
	pulse_resume();
	floating_resume();
	icm20649_resume();
	adis16100_resume();
	usb_host_start();
}

static void after_reset(avr_t *a)
{
	uint8_t cause = next_cause;

	hang_end();
	jtag_reset();
	led_shorted = false;
	if (supply_took_memory() || (cause & POWER_ON)) {
		scramble_memory();
		cause = POWER_ON;
	}
	if (supply_took_chips() || (cause & POWER_ON))
		power_devices();
	a->data[MCUSR] = cause;
	bench_trace("reset %s", name_of(cause));
	bench_reset();
	bootloader_ms = with_bootloader && bootloader_stays(cause) ? BOOTLOADER_MS : 0;
	if (with_bootloader) {
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
	return echo_resistor && port == 'C' && pin == 7;
}

/* While the bootloader waits, its LED breathes: PC7 is driven high and low by turns, against what drives the right echo line. */
static void breathe(void)
{
	bool level = bootloader_ms & 1;

	drive_leds();
	avr->data[PORTC] = (uint8_t)((avr->data[PORTC] & ~L_LED) | (level ? L_LED : 0));
	if (echo_resistor || led_shorted || !pin_is_held('C', 7, !level))
		return;
	led_shorted = true;
	bench_trace("contention on PC7, by the bootloader");
}

void board_reset(uint8_t cause)
{
	next_cause = cause;
	avr_reset(avr);
}

void board_watchdog(void)
{
	board_reset(WATCHDOG);
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

bool board_runs(void)
{
	if (bootloader_ms && plugged && !supply_in_brown_out() && --bootloader_ms == 0)
		end_bootloader();
	if (bootloader_ms && plugged)
		breathe();
	if (!plugged || supply_in_brown_out() || bootloader_ms)
		return false;
	if (supply_is_unreliable())
		hang_now();
	hang_millisecond();
	return true;
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

static bool reset_by(const char *value)
{
	if (!strcmp(value, "watchdog"))
		hang_soon(); /* the program's own watchdog does the rest */
	else if (!strcmp(value, "power"))
		board_reset(POWER_ON);
	else if (!strcmp(value, "external"))
		board_reset(EXTERNAL);
	else
		return false;
	return true;
}

bool board_fault(const char *name, const char *value)
{
	if (!strcmp(name, "reset"))
		return reset_by(value);
	if (!strcmp(name, "supply"))
		return supply_fault(value);
	if (!strcmp(name, "brown_out_fuse"))
		return supply_fuse(value);
	if (!strcmp(name, "cpu"))
		return hang_fault(value);
	if (!strcmp(name, "jtag_fuse"))
		return jtag_fault(value);
	if (!strcmp(name, "echo_resistor")) {
		echo_resistor = !strcmp(value, "1000");
		return echo_resistor || !strcmp(value, "none");
	}
	if (!strcmp(name, "bootloader")) {
		with_bootloader = !strcmp(value, "caterina");
		return with_bootloader || !strcmp(value, "none");
	}
	return false;
}

void board_init(void)
{
	signature_init();
	jtag_init();
	supply_init();
	avr->reset = after_reset;
	after_reset(avr);
}
