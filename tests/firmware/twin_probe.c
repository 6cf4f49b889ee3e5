/* SPDX-License-Identifier: MIT */
/* A program for the tests of the twin, with faults that the real firmware does not have. MODE chooses the case. The result is a trigger on
 * the bus: of the left ranger for yes, of the right one for no. */
#include <avr/io.h>
#include <avr/interrupt.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <util/delay.h>
#include <stdint.h>

enum { TWI_AFTER_RESET, SPI_WRONG, STOPPED, PULLED_UP, TIMER_FLAGS };

static void go(uint8_t control)
{
	TWCR = (uint8_t)(_BV(TWINT) | _BV(TWEN) | control);
	while (!(TWCR & _BV(TWINT)))
		;
}

static uint8_t start(void)
{
	go(_BV(TWSTA));
	return TWSR & 0xF8u;
}

static void put(uint8_t byte)
{
	TWDR = byte;
	go(0);
}

static void trigger(uint8_t address)
{
	put((uint8_t)(address << 1));
	put(0);
	put(0x52);
	TWCR = _BV(TWINT) | _BV(TWEN) | _BV(TWSTO);
}

static void answer(uint8_t yes)
{
	trigger(yes ? 0x70 : 0x71);
	for (;;)
		;
}

/* A start condition, and a watchdog reset before the stop: after the reset the next start must not be a repeated start. */
static void twi_after_reset(uint8_t cause)
{
	if (cause & _BV(WDRF))
		answer(start() == 0x08);
	wdt_enable(WDTO_15MS);
	(void)start();
	for (;;)
		;
}

static void spi_wrong(void)
{
	DDRB = _BV(PB0) | _BV(PB1) | _BV(PB2) | _BV(PB4);
	DDRD = _BV(PD7);
	PORTB = _BV(PB4);
	SPCR = _BV(SPE) | _BV(MSTR); /* 4 MHz, mode 0: too fast for both chips */
	PORTD = 0;
	PORTD = _BV(PD7);
	PORTB = 0;
	PORTB = _BV(PB4);
	SPCR = _BV(SPE) | _BV(MSTR) | _BV(SPR1) | _BV(SPR0); /* 125 kHz, mode 0: wrong edge for the gyro */
	PORTB = 0;
	PORTB = _BV(PB4);
	for (;;)
		;
}

/* An overflow of Timer1 that is flagged while interrupts are off stays flagged when the capture's flag is cleared, until its own is. */
static void timer_flags(void)
{
	TCCR1B = _BV(CS10);
	TIMSK1 = _BV(TOIE1);
	TCNT1 = 0xFF00;
	_delay_us(100);
	TIFR1 = _BV(ICF1);
	uint8_t kept = TIFR1 & _BV(TOV1);
	TIFR1 = _BV(TOV1);
	uint8_t cleared = !(TIFR1 & _BV(TOV1));
	(void)start();
	answer(kept && cleared);
}

/* SyncOut is driven low 3 ms after the start: neither its pull-up nor a write to another pin of its port makes it high. */
static void pulled_up(void)
{
	_delay_ms(3);
	PORTD = _BV(PD4);
	PORTD = _BV(PD4) | _BV(PD7);
	answer(start() == 0x08 && !(PIND & _BV(PD4)));
}

int main(void)
{
	uint8_t cause = MCUSR;

	MCUSR = 0;
	wdt_disable();
	TWBR = 72;
	if (MODE == TWI_AFTER_RESET)
		twi_after_reset(cause);
	if (MODE == SPI_WRONG)
		spi_wrong();
	if (MODE == PULLED_UP)
		pulled_up();
	if (MODE == TIMER_FLAGS)
		timer_flags();
	cli();
	sleep_enable();
	sleep_cpu();
	for (;;)
		;
}
