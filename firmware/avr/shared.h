/* What the files of avr/ share: each part's start, and the flag by which an interrupt ends the main loop's sleep. */
#ifndef ECHOSTEP_AVR_SHARED_H
#define ECHOSTEP_AVR_SHARED_H

#include <stdbool.h>
#include <stdint.h>
#include "../board.h"

#define BIT(n) ((uint8_t)(1u << (n)))

extern volatile bool awake; /* set by an interrupt that has news for the main loop, cleared by board_sleep */

void clock_start(void);
void clock_alarm(uint32_t ticks); /* an interrupt then, if that is less than 32 ms away; call with interrupts off */
void twi_start(void);
void spi_start(void);
void usb_start(void);

#endif
