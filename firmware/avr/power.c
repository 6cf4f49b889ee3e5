/* Start, sleep, watchdog, and what they can tell: why the board started and how much memory it has used. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/power.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include "shared.h"

#define PAINT 0xC5u
#define UNTOUCHED_MAX 64u     /* more than the largest array on the stack, which nobody has to fill */
#define ALARM_MARGIN_TICKS 4u /* too close for the alarm to be set in time */

/* Where the Caterina bootloaders, old and new, look for the wish to stay in the bootloader after a watchdog reset. */
#define BOOTLOADER_KEY 0x7777u
#define BOOTLOADER_KEY_OLD ((volatile uint16_t *)0x0800)
#define BOOTLOADER_KEY_NEW ((volatile uint16_t *)(RAMEND - 1))

volatile bool awake;

static uint8_t reset_cause;
extern uint8_t _end; /* linker: first byte after the static variables */

static void paint_free_memory(void)
{
	for (uint8_t *p = &_end; p < (uint8_t *)SP; p++)
		*p = PAINT;
}

void board_start(void)
{
	reset_cause = MCUSR;
	MCUSR = 0;
	wdt_disable(); /* after a reset of its own it still runs, at its shortest time */
	paint_free_memory();
	power_adc_disable();
	power_timer0_disable();
	power_timer3_disable();
	power_usart1_disable();
	ACSR = BIT(ACD);
	SMCR = SLEEP_MODE_IDLE;
	clock_start();
	spi_start();
	twi_start();
	usb_start();
	wdt_enable(WDTO_250MS);
	sei();
}

void board_sleep(uint32_t wake_ticks)
{
	wdt_reset();
	cli();
	clock_alarm(wake_ticks);
	while (!awake && !ticks_reached(clock_now() + ALARM_MARGIN_TICKS, wake_ticks)) {
		sleep_enable();
		sei(); /* takes effect after the next instruction: no interrupt slips in between */
		sleep_cpu();
		sleep_disable();
		cli();
	}
	awake = false;
	sei();
}

uint8_t board_reset_cause(void)
{
	return reset_cause;
}

/* Goes down from the deepest byte known so far until enough untouched ones follow each other: the whole way would take 0.7 ms. */
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
	*BOOTLOADER_KEY_OLD = BOOTLOADER_KEY;
	*BOOTLOADER_KEY_NEW = BOOTLOADER_KEY;
	wdt_enable(WDTO_120MS);
	for (;;)
		;
}
