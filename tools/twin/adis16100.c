/* SPDX-License-Identifier: GPL-3.0-or-later
 * Three ADIS16100 rate gyros [data sheet, and public drivers where it is silent].
 *
 * 16-bit frames; the answer to a frame comes with the next one: channel in bits 13:12, value in 11:0. Bit 15 writes the control register:
 * channel 11:10 (rate, temperature, AIN1, AIN2), power 9:8 (11 = on), coding bit 4 (1 = offset binary). */
#include <string.h>

#include "twin.h"

#define WRITE 0x8000u
#define OFFSET_BINARY 0x0010u
#define MAX_HERTZ 2500000u
#define TEMPERATURE_25C 0
#define FALLING_EDGE(mode) ((mode) == 1 || (mode) == 2)
#define MID_SCALE 2048

static struct gyro {
	struct spi_device spi;
	const char *name;
	int channel_of_row;
	bool absent, wrong_channel;
	uint16_t control, answer, incoming, count;
	bool garbled; /* the processor's edges are not the chip's */
} gyros[3] = { { .name = "thigh", .channel_of_row = 0 }, { .name = "calf", .channel_of_row = 1 }, { .name = "belt", .channel_of_row = 2 } };

static uint16_t convert(const struct gyro *g)
{
	unsigned channel = (g->control >> 10) & 3;
	int value = channel == 0 ? row.rate[g->channel_of_row] : channel == 1 ? TEMPERATURE_25C : 0;

	if ((g->control & 0x0300u) != 0x0300u)
		return 0; /* powered down */
	if (g->control & OFFSET_BINARY)
		value += MID_SCALE;
	if (g->wrong_channel)
		channel ^= 1u;
	return (uint16_t)((channel << 12) | ((unsigned)value & 0xFFFu));
}

static void on_select(struct spi_device *self, bool on)
{
	struct gyro *g = (struct gyro *)self;

	if (!on && g->count == 2) {
		if (g->incoming & WRITE)
			g->control = g->incoming;
		g->answer = convert(g);
	}
	g->count = 0;
	if (!on)
		return;
	g->garbled = spi_hertz() > MAX_HERTZ || !FALLING_EDGE(spi_mode());
	if (spi_hertz() > MAX_HERTZ)
		bench_trace("adis16100 too fast");
	else if (g->garbled)
		bench_trace("adis16100 wrong mode");
}

static uint8_t on_exchange(struct spi_device *self, uint8_t out)
{
	struct gyro *g = (struct gyro *)self;
	uint8_t in = (uint8_t)(g->count == 0 ? g->answer >> 8 : g->answer);

	if (g->garbled) { /* everything is a bit late */
		in = (uint8_t)(in >> 1);
		out = (uint8_t)(out >> 1);
	}
	g->incoming = (uint16_t)(g->incoming << 8 | out);
	g->count++;
	return g->absent ? 0xFF : in;
}

void adis16100_power(void)
{
	for (int k = 0; k < 3; k++) {
		struct gyro *g = &gyros[k];

		if (!g->spi.select) {
			g->spi = (struct spi_device){ 'B', (uint8_t)(4 + k), on_select, on_exchange, false, NULL };
			spi_add(&g->spi);
		}
		g->control = g->answer = g->count = 0;
		g->spi.selected = false;
	}
}

bool adis16100_fault(const char *name, const char *value)
{
	for (int k = 0; k < 3; k++)
		if (!strcmp(name, gyros[k].name)) {
			gyros[k].absent = !strcmp(value, "absent");
			gyros[k].wrong_channel = !strcmp(value, "wrong_channel");
			return gyros[k].absent || gyros[k].wrong_channel || !strcmp(value, "ok");
		}
	return false;
}
