/* SPDX-License-Identifier: MIT */
/* SPI master: polled bytes to one of four chips, in the mode and at the rate of the part; and the other pins of these
 * chips. SCK PB1, MOSI PB2, MISO PB3; chip selects PB4 thigh, PB5 calf, PB6 belt, PD7 barometer, active low; DRDY of
 * the SCP1000 on PE6; the gyros' ST1 on PF7, ST2 on PF6. */
#include <avr/io.h> /* registers */
#include "shared.h"

#define SS BIT(PB0) /* must be an output: as an input, a low level would end master mode */
#define SCK BIT(PB1)
#define MOSI BIT(PB2)
#define MISO BIT(PB3)
#define GYRO_SELECTS (BIT(PB4) | BIT(PB5) | BIT(PB6))
#define PRESSURE_SELECT BIT(PD7)
#define DRDY BIT(PE6)
#define ST1 BIT(PF7)
#define ST2 BIT(PF6)

#define MASTER (BIT(SPE) | BIT(MSTR))
#define GYRO_MODE (BIT(CPOL) | BIT(SPR0)) /* mode 2; with SPI2X 16 MHz / 8 = 2 MHz */
#define EXCHANGE_TRIES 255u                        /* more than 1000 cycles; a byte takes at most 512 */

static const uint8_t protocols[][2] FLASH = { /* SPCR, SPSR */
	[SPI_ADIS16100] = { MASTER | GYRO_MODE, BIT(SPI2X) },
	[SPI_SCP1000] = { MASTER | BIT(SPR1), 0 }, /* mode 0; 16 MHz / 64 = 250 kHz */
	[SPI_MODE3] = { MASTER | BIT(CPOL) | BIT(CPHA) | BIT(SPR0), 0 },
};

void spi_start(void)
{
	PORTB |= SS | GYRO_SELECTS | MISO; /* MISO pulled up: an absent chip reads as ones */
	DDRB |= SS | SCK | MOSI | GYRO_SELECTS;
	PORTD |= PRESSURE_SELECT;
	DDRD |= PRESSURE_SELECT;
	DDRF |= ST1 | ST2; /* low */
}

uint8_t spi_begin(enum chip chip, enum spi_protocol protocol, uint8_t first_byte)
{
	SPCR = flash_byte(&protocols[protocol][0]);
	SPSR = flash_byte(&protocols[protocol][1]);
	if (chip == CHIP_PRESSURE)
		PORTD &= (uint8_t)~PRESSURE_SELECT;
	else
		PORTB &= (uint8_t)~(uint8_t)(BIT(PB4) << chip);
	return spi_exchange(first_byte);
}

uint8_t spi_exchange(uint8_t out)
{
	SPDR = out;
	for (uint8_t n = 0; n < EXCHANGE_TRIES && !(SPSR & BIT(SPIF)); n++)
		;
	return SPDR;
}

void spi_release(void)
{
	PORTB |= GYRO_SELECTS;
	PORTD |= PRESSURE_SELECT;
}

void spi_write(enum chip chip, enum spi_protocol protocol, uint8_t address, uint8_t value)
{
	(void)spi_begin(chip, protocol, address);
	(void)spi_exchange(value);
	spi_release();
}

bool spi_pressure_ready(void)
{
	return PINE & DRDY;
}

void spi_excite_gyros(enum excitation excitation)
{
	PORTF = excitation == EXCITE_ST1 ? ST1 : excitation == EXCITE_ST2 ? ST2 : 0;
}
