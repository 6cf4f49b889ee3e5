/* SPDX-License-Identifier: MIT */
/* The functions that the portable firmware needs from the board. `avr/` implements them for the ATmega32U4; a test may
 * implement them in memory. The prefix of a name is its file in `avr/`. None blocks longer than its comment says. All
 * are called from the main loop, never from an interrupt. */
#ifndef ECHOSTEP_BOARD_H
#define ECHOSTEP_BOARD_H

#include <stdbool.h>
#include <stdint.h>

/* Constant tables of bytes stay in flash: `static const uint8_t table[] FLASH`, read by flash_byte. */
#ifdef __AVR__
#include <avr/pgmspace.h>
#define FLASH PROGMEM
#define flash_byte(address) pgm_read_byte(address)
#else
#define FLASH
#define flash_byte(address) (*(address))
#endif

/* Time: 0.5 us ticks since the start, wrapping after 35.8 minutes. */
#define TICKS_PER_MS UINT32_C(2000)
#define TICKS_PER_S UINT32_C(2000000)

uint32_t clock_now(void);

/* Whether `now` is at or after `then`; correct while the two are less than 17.9 minutes apart. */
static inline bool ticks_reached(uint32_t now, uint32_t then)
{
	return (int32_t)(now - then) >= 0;
}

/* A rising edge of the SyncOut input, which on a foot board is the data-ready line of its part. */
struct capture_edge {
	uint32_t ticks;  /* captured by the timer itself */
	uint16_t edge;   /* edges since the start */
	uint16_t missed; /* edges since the previous call that this one has overwritten */
};
bool capture_take_edge(struct capture_edge *out); /* false: no edge since the last call */

/* I2C at 100 kHz, one transfer at a time, carried out by interrupts. */
enum twi_state { TWI_BUSY, TWI_DONE, TWI_NACK, TWI_FAILED };

struct twi_transfer {
	uint8_t address;        /* 7 bits */
	uint8_t write_length;   /* 0-4 bytes to write */
	uint8_t read_length;    /* 0-7 bytes to read, after a repeated start if bytes were written */
	uint8_t bytes[7];       /* in: the bytes to write; out: the bytes read */
	volatile uint8_t state; /* enum twi_state */
	uint32_t ticks;         /* of the stop condition */
};
/* Starts a transfer; false: the bus is in use. The caller must not touch the transfer while its state is TWI_BUSY. */
bool twi_begin(struct twi_transfer *transfer);
enum twi_state twi_state(const struct twi_transfer *transfer);
/* Ends a transfer that has taken longer than 5 ms as TWI_FAILED and frees the bus (0.2 ms); true: it did so. */
bool twi_watch(uint32_t now);

/* SPI: bytes in both directions between select and release, with the clock rate and the mode of the part that may be
 * there. */
enum chip { CHIP_THIGH, CHIP_CALF, CHIP_BELT, CHIP_PRESSURE };
enum spi_protocol {
	SPI_ADIS16100, /* mode 2, 2 MHz */
	SPI_SCP1000,   /* mode 0, 250 kHz */
	/* 1 MHz, for the level shifters of the boards with BMP390, LSM6DSO, ICM-20649 rise in up to 0.41 us */
	SPI_MODE3,
};
/* selects; the chip's byte while it gets the first one */
uint8_t spi_begin(enum chip chip, enum spi_protocol protocol, uint8_t first_byte);
uint8_t spi_exchange(uint8_t out);
void spi_release(void);
/* a whole transfer of two bytes */
void spi_write(enum chip chip, enum spi_protocol protocol, uint8_t address, uint8_t value);
bool spi_pressure_ready(void); /* level of the SCP1000's DRDY */

/* Self-test inputs of the gyros; one pin drives the input of all three. */
enum excitation { EXCITE_NONE, EXCITE_ST1, EXCITE_ST2 };
void spi_excite_gyros(enum excitation excitation);

/* USB CDC-ACM. */
#define USB_ROOM 1023u /* size of the send buffer, bytes */

void usb_run(void);                                   /* moves bytes and answers the host's requests */
/* whether a host program has the port open (DTR), and the bus is not suspended */
bool usb_is_open(void);
bool usb_take_opening(void);                          /* true once after each opening, which empties the buffers */
bool usb_write(const uint8_t *bytes, uint8_t length); /* all bytes; false: no room, none was taken */
int16_t usb_read(void);                               /* one byte, or -1 */
bool usb_bootloader_wanted(void);                     /* whether the port has been closed at 1200 Bd for 0.12 s */
void usb_name_foot(void);                             /* the interface's string is "foot" instead of "belt" */
/* how often the host has suspended the bus since the start; wraps */
uint8_t usb_suspends(void);

/* The echo lines of pulse rangers, side 0 left, 1 right: both edges are captured by a timer each. The left line is also
 * SyncOut: its edges count as such except between capture_trigger and capture_end_pulse, or the end of the pulse. */
enum capture_state { CAPTURE_WAITING, CAPTURE_HIGH, CAPTURE_OVER };

struct capture_pulse {
	uint32_t rise, fall; /* ticks; fall is valid when the pulse is over */
};
/* sends a trigger pulse (60 us); false: the line is high, or pulses without one */
bool capture_trigger(uint8_t side);
bool capture_pull_low(uint8_t side);  /* pulls the line low for 0.2 ms, against 1 kohm in Echo; true: it stays low */
enum capture_state capture_take_pulse(uint8_t side, struct capture_pulse *out);
void capture_end_pulse(uint8_t side); /* gives up waiting */

/* Levels of inputs; no chip may be selected. */
enum level { LEVEL_MISO, LEVEL_D4, LEVEL_D13, LEVEL_SDA, LEVEL_SCL, LEVELS };
uint8_t levels_read(void); /* a bit for each */

/* Supply voltage. */
/* 1024 * 1.1 V / supply, and starts the next measurement (0.1 ms); false: not finished */
bool adc_take(uint16_t *reading);

/* What survives a reset of the processor, but not a loss of power. */
struct restart {
	uint8_t cause;          /* of this start, RESET_CAUSE_* flags */
	uint8_t starts;         /* since power was applied; at most 255 */
	uint8_t crashes;        /* restarts by the watchdog among them */
	uint8_t crash_place;    /* of the last crash, CRASH_PLACE_* */
	uint16_t crash_address; /* of the last crash, in words; 0: unknown */
};
const struct restart *restart_known(void);
void restart_enter(uint8_t place);   /* the main loop begins a part, CRASH_PLACE_* */
void restart_note_sag(bool sagging); /* whether the supply is far below its usual voltage: explains the next reset */

/* Power and start. */
void board_start(void);                /* pins, clock, buses, USB, watchdog, interrupts */
/* Longest turn of the main loop, between two sleeps, and longest time from a timer's event to its interrupt, in ticks,
 * since the last call. */
void board_take_timing(uint16_t *turn, uint16_t *latency);
/* until then, or until an interrupt needs the main loop; restarts the watchdog */
void board_sleep(uint32_t wake_ticks);
void board_lamp(bool level);            /* the LED beside the USB plug: which level lights it depends on the board */
uint16_t board_memory_used(void);      /* bytes: static RAM plus the deepest stack since the start */
void board_bootloader(void);           /* resets the processor into the bootloader; does not return */

#endif
