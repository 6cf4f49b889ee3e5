/* SPDX-License-Identifier: MIT */
/* Analog converter: the processor's 1.1 V reference against the supply. */
#include <avr/io.h> /* registers */
#include "shared.h"

#define BANDGAP (BIT(MUX4) | BIT(MUX3) | BIT(MUX2) | BIT(MUX1))
#define PRESCALE_128 (BIT(ADPS2) | BIT(ADPS1) | BIT(ADPS0)) /* 125 kHz: a conversion takes 0.1 ms */

void adc_start(void)
{
	ADMUX = BIT(REFS0) | BANDGAP; /* the supply is the converter's full scale */
	ADCSRA = BIT(ADEN) | BIT(ADSC) | PRESCALE_128;
}

bool adc_take(uint16_t *reading)
{
	if (ADCSRA & BIT(ADSC))
		return false;
	*reading = ADC;
	ADCSRA |= BIT(ADSC);
	return true;
}
