/* SPDX-License-Identifier: MIT */
/* I2C master: interrupts carry out one transfer at a time; the main loop frees a stuck bus. SCL is PD0, SDA is PD1. */
#include <avr/interrupt.h> /* ISR */
#include <avr/io.h>        /* registers */
#include <util/atomic.h>   /* ATOMIC_BLOCK */
#include <util/delay.h>    /* clocking the lines by hand */
#include <util/twi.h>      /* status codes */
#include "shared.h"

#define SCL BIT(PD0)
#define SDA BIT(PD1)
#define BIT_RATE 72u                       /* 16 MHz / (16 + 2 * 72) = 100 kHz */
#define STOP_TICKS 20u                     /* from the request to the stop condition: one bit */
#define TRANSFER_MAX_TICKS (5u * TICKS_PER_MS)
#define STOP_TRIES 100u                    /* 40 us: four times the duration of a stop condition */
#define HALF_BIT_US 5
#define RECOVERY_PULSES 9u                 /* a device holds SDA for at most eight bits and an acknowledge */

#define GO (BIT(TWINT) | BIT(TWEN) | BIT(TWIE))

static struct twi_transfer *volatile current; /* 0: the bus is free */
static uint8_t byte_index;                    /* next byte of the transfer */
static uint32_t started;                      /* ticks */

void twi_start(void)
{
	PORTD |= SCL | SDA; /* pull-ups: without any device the lines must still be high */
	TWSR = 0;
	TWBR = BIT_RATE;
}

static void await_stop(void)
{
	for (uint8_t n = 0; n < STOP_TRIES && (TWCR & BIT(TWSTO)); n++)
		;
}

bool twi_begin(struct twi_transfer *transfer)
{
	if (current)
		return false;
	await_stop(); /* if the stop never ends, this transfer times out */
	byte_index = 0;
	transfer->state = TWI_BUSY;
	started = clock_now();
	current = transfer;
	TWCR = GO | BIT(TWSTA);
	return true;
}

enum twi_state twi_state(const struct twi_transfer *transfer)
{
	enum twi_state state = transfer->state;
	/* the interrupt writes bytes and ticks before the state: the caller must read them after it */
	__asm__ volatile("" ::: "memory");
	return state;
}

static void finish(enum twi_state state)
{
	current->ticks = clock_now() + STOP_TICKS;
	current->state = state;
	current = 0;
	board_awake = true;
}

/* SCL is held low until TWCR is written. So the clock, read right after it, gives the time of the stop condition
 * however late this interrupt is. */
static void stop(enum twi_state state)
{
	TWCR = BIT(TWINT) | BIT(TWEN) | BIT(TWSTO);
	finish(state);
}

static void write_next(void)
{
	if (byte_index < current->write_length) {
		TWDR = current->bytes[byte_index++];
		TWCR = GO;
	} else if (current->read_length) {
		TWCR = GO | BIT(TWSTA);
	} else {
		stop(TWI_DONE);
	}
}

static void read_next(void)
{
	TWCR = byte_index + 1 < current->read_length ? GO | BIT(TWEA) : GO;
}

ISR(TWI_vect)
{
	if (!current) { /* twi_watch has ended the transfer */
		TWCR = BIT(TWEN);
		return;
	}
	switch (TW_STATUS) {
	case TW_START:
		TWDR = (uint8_t)(current->address << 1 | (current->write_length ? TW_WRITE : TW_READ));
		TWCR = GO;
		break;
	case TW_REP_START:
		TWDR = (uint8_t)(current->address << 1 | TW_READ);
		TWCR = GO;
		byte_index = 0;
		break;
	case TW_MT_SLA_ACK:
	case TW_MT_DATA_ACK:
		write_next();
		break;
	case TW_MR_DATA_ACK:
		current->bytes[byte_index++] = TWDR;
		read_next();
		break;
	case TW_MR_SLA_ACK:
		read_next();
		break;
	case TW_MR_DATA_NACK:
		current->bytes[byte_index] = TWDR;
		stop(TWI_DONE);
		break;
	case TW_MT_SLA_NACK:
	case TW_MT_DATA_NACK:
	case TW_MR_SLA_NACK:
		stop(TWI_NACK);
		break;
	case TW_MT_ARB_LOST: /* a device holds a line low: no stop condition can be sent */
		TWCR = BIT(TWINT) | BIT(TWEN);
		finish(TWI_FAILED);
		break;
	default:
		stop(TWI_FAILED);
	}
}

/* The lines are driven low or released, never driven high. */
static void drive_low(uint8_t line)
{
	DDRD |= line;
	_delay_us(HALF_BIT_US);
}

static void release(uint8_t line)
{
	DDRD &= (uint8_t)~line;
	_delay_us(HALF_BIT_US);
}

/* Frees a bus whose SDA a device holds low: clocks the device through its byte, then sends a stop condition [I2C
 * specification, 3.1.16]. */
static void free_bus(void)
{
	TWCR = 0;
	PORTD &= (uint8_t)~(SCL | SDA);
	for (uint8_t n = 0; n < RECOVERY_PULSES; n++) {
		drive_low(SCL);
		release(SCL);
	}
	drive_low(SCL);
	drive_low(SDA);
	release(SCL);
	release(SDA);
	PORTD |= SCL | SDA;
}

bool twi_watch(uint32_t now)
{
	bool stuck = false;
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		if (current && ticks_reached(now, started + TRANSFER_MAX_TICKS)) {
			stuck = true;
			TWCR = 0;
			finish(TWI_FAILED);
		}
	}
	if (stuck)
		free_bus();
	return stuck;
}
