/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPI master with the clock of SPCR and SPSR (in simavr a byte takes 100 us), and chip selects on port pins.
 *
 * In modes 1 and 2 the processor changes MOSI at the rising edge at which parts of modes 0 and 3 sample it. Their level
 * shifters let lines fall fast and rise slowly, so that such a part reads a one only where the bit before and the bit
 * after the edge are both ones, and its answers arrive one bit late. The bit behind a byte is assumed to be a zero. */
#include <simavr/avr_ioport.h>
#include <simavr/avr_spi.h>
#include <simavr/sim_cycle_timers.h>
#include <simavr/sim_interrupts.h>

#include "parts/parts.h"

enum { SPCR = 0x4C, SPSR, SPDR };
enum { SPE = 0x40, MSTR = 0x10 };
#define VECTOR 24

static struct spi_device *devices;
static avr_irq_t *miso;
static uint8_t outgoing;
FAULT_SWITCH(spi_errors, "<=1000", NULL, 0) /* bytes in 1000 that a part sends and that arrive with a wrong bit */
FAULT_SWITCH(mosi_errors, "<=1000", NULL, 0) /* the same of those from the processor */

static unsigned divisor(void)
{
	static const unsigned by_rate[4] = { 4, 16, 64, 128 };
	unsigned d = by_rate[avr->data[SPCR] & 3];

	return avr->data[SPSR] & 1 ? d / 2 : d;
}

static unsigned hertz(void)
{
	return 16000000u / divisor();
}

unsigned spi_mode(void)
{
	return (avr->data[SPCR] >> 2) & 3;
}

static bool shifts_at_rising_edges(void)
{
	return spi_mode() == 1 || spi_mode() == 2;
}

uint8_t spi_at_rising_edges(uint8_t out)
{
	return shifts_at_rising_edges() ? out & (uint8_t)(out << 1) : out;
}

int spi_answer(int answer)
{
	return answer != SPI_OPEN && shifts_at_rising_edges() ? answer >> 1 : answer;
}

bool spi_outruns(unsigned rise_ns)
{
	return 500000000u / hertz() < rise_ns;
}

bool spi_garbles(const char *chip, unsigned most_hertz, bool right_mode)
{
	bool too_fast = hertz() > most_hertz;

	if (too_fast || !right_mode)
		bench_trace("%s %s", chip, too_fast ? "too fast" : "wrong mode");
	return too_fast || !right_mode;
}

static avr_cycle_count_t done(avr_t *a, avr_cycle_count_t when, void *param)
{
	int answer = SPI_OPEN;

	for (struct spi_device *d = devices; d; d = d->next) {
		int driven = d->selected ? d->part.model->exchange(d, outgoing) : SPI_OPEN;

		if (!d->selected && d->part.model->overhear)
			d->part.model->overhear(d);
		if (driven != SPI_OPEN && answer != SPI_OPEN)
			bench_trace("contention on MISO");
		if (driven != SPI_OPEN)
			answer = driven;
	}
	if (answer != SPI_OPEN)
		answer = disturbed((uint8_t)answer, spi_errors.value);
	avr_raise_irq(miso, answer == SPI_OPEN ? miso_idle() : (uint32_t)answer);
	return 0;
}

static void write_byte(avr_t *a, avr_io_addr_t address, uint8_t value, void *param)
{
	if ((a->data[SPCR] & (SPE | MSTR)) != (SPE | MSTR))
		return;
	avr_regbit_clear(a, vector(VECTOR)->raised);
	outgoing = disturbed(value, mosi_errors.value);
	avr_cycle_timer_register(a, divisor() * 8 + 1, done, NULL);
}

static void select_changed(struct avr_irq_t *irq, uint32_t level, void *param)
{
	struct spi_device *d = param;

	if (d->selected != !level) {
		d->selected = !level;
		d->part.model->select(d, d->selected);
		if (d->selected)
			hang_spi_selected();
	}
}

void spi_init(void)
{
	take_register(SPDR, NULL, write_byte);
	miso = avr_io_getirq(avr, AVR_IOCTL_SPI_GETIRQ(0), SPI_IRQ_INPUT);
}

void spi_reset(void)
{
	for (struct spi_device *d = devices; d; d = d->next)
		select_changed(NULL, 1, d); /* the pins are inputs after a reset, and the chips pull them up */
}

void spi_add(struct spi_device *device)
{
	avr_irq_t *pin = avr_io_getirq(avr, (uint32_t)AVR_IOCTL_IOPORT_GETIRQ(device->port), device->pin);

	device->next = devices;
	devices = device;
	avr_irq_register_notify(pin, select_changed, device);
}
