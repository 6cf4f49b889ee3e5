/* SPDX-License-Identifier: GPL-3.0-or-later
 * Three ADIS16100 rate gyros [data sheet; public drivers for what it does not state].
 *
 * 16-bit frames; the answer to a frame comes with the next one: channel in bits 13:12, value in 11:0. Bit 15 writes the
 * control register: channel 11:10 (rate, temperature, AIN1, AIN2), power 9:8 (11 = on), coding bit 4 (1 = offset
 * binary).
 *
 * ST1 (PF7) and ST2 (PF6), wired to all three, change the rate by -221 and +221 counts, through the 40 Hz filter; the
 * response varies by a tenth from part to part. The temperature is the row's, 6.88 counts per degree from 25 degC. */
#include <math.h>
#include <string.h>

#include <simavr/avr_ioport.h>

#include "parts/parts.h"

#define WRITE 0x8000u
#define POWER_ON 0x0300u
#define OFFSET_BINARY 0x0010u
#define MAX_HERTZ 2500000u
#define MID_SCALE 2048
#define FULL_SCALE 2047
#define FILTER_S 0.004 /* 40 Hz */
enum { ST2 = 6, ST1 = 7 };
enum { WRONG_CHANNEL = OTHER_FAULTS, STUCK, WEAK, ZEROS };

static struct gyro {
	struct spi_device spi;
	int stuck_rate;
	double excited; /* counts added by ST1 and ST2 at the time `excited_at` */
	int response;   /* of this part to ST1 or ST2, counts */
	uint16_t control, answer, incoming, count;
	bool garbled; /* the processor uses the wrong clock edge or a too fast clock */
} gyros[3] = {
	{ .spi = { .part = PART(adis16100, PLACE_THIGH, "thigh"), .port = 'B', .pin = 4 } },
	{ .spi = { .part = PART(adis16100, PLACE_CALF, "calf"), .port = 'B', .pin = 5 } },
	{ .spi = { .part = PART(adis16100, PLACE_BELT, "belt"), .port = 'B', .pin = 6 } },
};
static bool inputs[2]; /* ST1, ST2 */
static avr_cycle_count_t excited_at;

/* Counts that the self-test inputs add once the filter has settled. */
static double target(const struct gyro *g)
{
	double response = g->spi.part.fault.value == WEAK ? g->response * 0.1 : g->response;

	return (inputs[1] ? response : 0.0) - (inputs[0] ? response : 0.0);
}

/* Counts that the self-test inputs add now. */
static double excitation(const struct gyro *g)
{
	return target(g) + (g->excited - target(g)) * exp(-(double)(avr->cycle - excited_at) / 16e6 / FILTER_S);
}

static void input_changed(struct avr_irq_t *irq, uint32_t level, void *param)
{
	for (int k = 0; k < 3; k++)
		gyros[k].excited = excitation(&gyros[k]);
	excited_at = avr->cycle;
	*(bool *)param = level && !jtag_owns_analog_pins();
}

static int rate_of(const struct gyro *g)
{
	int rate = input.row.rate[g - gyros] + (int)lround(excitation(g));

	if (g->spi.part.fault.value == STUCK)
		return g->stuck_rate;
	return rate > FULL_SCALE ? FULL_SCALE : rate < -MID_SCALE ? -MID_SCALE : rate;
}

static uint16_t convert(const struct gyro *g)
{
	unsigned channel = (g->control >> 10) & 3;
	int warmth = (int)lround((input.row.temperature / 20.0 - 25.0) * 6.88);
	int value = channel == 0 ? rate_of(g) : channel == 1 ? warmth : 0;

	if ((g->control & POWER_ON) != POWER_ON)
		return 0;
	if (g->control & OFFSET_BINARY)
		value += MID_SCALE;
	if (g->spi.part.fault.value == WRONG_CHANNEL)
		channel ^= 1u;
	return (uint16_t)((channel << 12) | ((unsigned)value & 0xFFFu));
}

static void on_select(void *self, bool on)
{
	struct gyro *g = self;

	if (!on && g->count == 2) {
		if (g->incoming & WRITE)
			g->control = g->incoming;
		g->answer = convert(g);
	}
	g->count = 0;
	if (on && part_is_plugged(self))
		g->garbled = spi_garbles("adis16100", MAX_HERTZ, spi_mode() == 1 || spi_mode() == 2);
}

static int on_exchange(void *self, uint8_t out)
{
	struct gyro *g = self;
	uint8_t in = (uint8_t)(g->count == 0 ? g->answer >> 8 : g->answer);

	g->incoming = (uint16_t)(g->incoming << 8 | out >> g->garbled);
	g->count++;
	if (!part_is_here(self))
		return SPI_OPEN;
	return g->spi.part.fault.value == ZEROS ? 0 : in >> g->garbled;
}

static void wire(void *self)
{
	struct gyro *g = self;

	g->response = 199 + (int)random_below(45);
	if (g != gyros)
		return;
	avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('F'), ST1), input_changed, &inputs[0]);
	avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('F'), ST2), input_changed, &inputs[1]);
}

static void power(void *self)
{
	struct gyro *g = self;

	g->excited = 0.0;
	g->control = g->answer = g->count = 0;
}

/* The processor's pins are inputs, and the chips pull ST1 and ST2 low. */
static void resume(void *self)
{
	memset(inputs, 0, sizeof inputs);
	excited_at = avr->cycle;
}

static void changed(void *self, unsigned before)
{
	struct gyro *g = self;

	g->stuck_rate = input.row.rate[g - gyros];
}

const struct model adis16100 = {
	.kind = OF_PAPERS,
	.faults = "ok absent wrong_channel stuck no_self_test zeros",
	PARTS(gyros),
	.wire = wire,
	.power = power,
	.resume = resume,
	.changed = changed,
	.select = on_select,
	.exchange = on_exchange,
};
