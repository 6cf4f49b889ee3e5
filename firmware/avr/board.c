/* SPDX-License-Identifier: MIT */
/* Start and sleep of the processor; its memory use; its bootloader. */
#include <avr/interrupt.h> /* cli, sei */
#include <avr/io.h>        /* registers */
#include <avr/power.h>     /* switching off unused parts */
#include <avr/sleep.h>     /* sleep_cpu */
#include <avr/wdt.h>       /* watchdog */
#include "shared.h"

#define PAINT 0xC5u           /* free memory is filled with this byte at the start */
#define UNTOUCHED_MAX 64u     /* bytes: more than the largest array on the stack, which may stay partly unwritten */
#define ALARM_MARGIN_TICKS 4u /* too close for the alarm to be set in time */

/* Caterina stays in the bootloader after a watchdog reset when this key is in RAM; old and new versions look at
 * different addresses. */
#define BOOTLOADER_KEY 0x7777u
#define BOOTLOADER_KEY_OLD ((volatile uint16_t *)0x0800)
#define BOOTLOADER_KEY_NEW ((volatile uint16_t *)(RAMEND - 1))

volatile bool board_awake;

extern uint8_t _end; /* linker: first byte after the static variables */

static void paint_free_memory(void)
{
	for (uint8_t *p = &_end; p < (uint8_t *)SP; p++)
		*p = PAINT;
}

/* A0 to A3 belong to JTAG where its fuse is set, until this bit is written twice within four cycles [data sheet,
 * 26.5.1]. */
static void free_analog_pins(void)
{
	uint8_t control = MCUCR | BIT(JTD);
	MCUCR = control;
	MCUCR = control;
}

void board_start(void)
{
	restart_begin(MCUSR, USBCON & BIT(USBE));
	MCUSR = 0;
	free_analog_pins();
	paint_free_memory();
	power_timer0_disable();
	power_timer3_disable();
	power_usart1_disable();
	ACSR = BIT(ACD);
	SMCR = SLEEP_MODE_IDLE;
	clock_start();
	capture_start();
	spi_start();
	twi_start();
	usb_start();
	adc_start();
	sei();
}

/* PB0, the RX LED, is an output for SPI's sake. */
void board_lamp(bool level)
{
	if (level)
		PORTB |= BIT(PB0);
	else
		PORTB &= (uint8_t)~BIT(PB0);
}

static uint32_t woke;         /* when the turn of the main loop began */
static uint16_t longest_turn; /* ticks */

static void note_turn(void)
{
	uint32_t turn = clock_now() - woke;
	if (turn > longest_turn)
		longest_turn = turn < UINT16_MAX ? (uint16_t)turn : UINT16_MAX;
}

void board_take_timing(uint16_t *turn, uint16_t *latency)
{
	*turn = longest_turn;
	*latency = clock_take_latency();
	longest_turn = 0;
}

void board_sleep(uint32_t wake_ticks)
{
	wdt_reset();
	note_turn();
	cli();
	clock_alarm(wake_ticks);
	while (!board_awake && !ticks_reached(clock_now() + ALARM_MARGIN_TICKS, wake_ticks)) {
		sleep_enable();
		sei(); /* takes effect after the next instruction: no interrupt can come before the sleep */
		sleep_cpu();
		sleep_disable();
		cli();
	}
	board_awake = false;
	sei();
	woke = clock_now();
}

/* Searches downwards from the deepest byte known so far, until UNTOUCHED_MAX painted bytes follow each other. A search
 * of the whole memory would take 0.7 ms. */
uint16_t board_memory_used(void)
{
	static const uint8_t *deepest = (const uint8_t *)(RAMEND + 1);
	for (uint8_t clean = 1; clean <= UNTOUCHED_MAX && deepest - clean >= &_end; clean++) {
		if (deepest[-clean] != PAINT) {
			deepest -= clean;
			clean = 0;
		}
	}
	return (uint16_t)((uintptr_t)&_end - RAMSTART + RAMEND + 1u - (uintptr_t)deepest);
}

void board_bootloader(void)
{
	cli();
	restart_forget();
	*BOOTLOADER_KEY_OLD = BOOTLOADER_KEY;
	*BOOTLOADER_KEY_NEW = BOOTLOADER_KEY;
	wdt_enable(WDTO_120MS);
	for (;;)
		;
}
