/* SPDX-License-Identifier: MIT */
/* Shared by the files of avr/: the start function of each part, and the flag by which an interrupt ends the main loop's
 * sleep. */
#ifndef ECHOSTEP_AVR_SHARED_H
#define ECHOSTEP_AVR_SHARED_H

#include <stdbool.h>
#include <stdint.h>
#include "../board.h" /* the functions that avr/ implements */

#define BIT(n) ((uint8_t)(1u << (n)))

extern volatile bool board_awake; /* set by an interrupt that needs the main loop, cleared by board_sleep */

void clock_start(void);
/* an interrupt at that time, which must be less than 32 ms away; call with interrupts off */
void clock_alarm(uint32_t ticks);
uint16_t clock_take_latency(void);         /* longest of an interrupt since the last call, ticks */
/* the time at which Timer1 had this value, less than 32 ms ago; call with interrupts off */
uint32_t clock_at(uint16_t timer);
void capture_start(void);
void twi_start(void);
void spi_start(void);
void usb_start(void);
void adc_start(void);
/* with the flags of MCUSR, which a bootloader may have cleared */
void restart_begin(uint8_t flags, bool bootloader_waited);
void restart_forget(void);                                 /* the next start counts as one after a loss of power */

#endif
