/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two-wire interface, master mode [ATmega32U4 data sheet, chapter 20]: bit timing of TWBR and TWSR, devices on the bus,
 * clock stretching, an SDA line that a device may hold low until it has received nine clocks, and an SCL line that one
 * may hold low. */
#include <simavr/avr_ioport.h>
#include <simavr/sim_cycle_timers.h>
#include <simavr/sim_interrupts.h>

#include "parts/parts.h"

enum { TWBR = 0xB8, TWSR, TWAR, TWDR, TWCR };
enum { TWINT = 0x80, TWEA = 0x40, TWSTA = 0x20, TWSTO = 0x10, TWEN = 4, TWIE = 1 };
#define SCL 1u /* of port D */
enum { /* status codes [data sheet, tables 20-3 and 20-4] */
	STATUS_START = 0x08,
	STATUS_REPEATED_START = 0x10,
	STATUS_WRITE_ADDRESS = 0x18,
	STATUS_WRITE = 0x28,
	STATUS_LOST = 0x38,
	STATUS_READ_ADDRESS = 0x40,
	STATUS_READ = 0x50,
	STATUS_IDLE = 0xF8,
	NOT_ACKNOWLEDGED = 0x08, /* is added */
};
#define VECTOR 36
#define BITS_PER_BYTE 9 /* with the acknowledge */
#define CLOCKS_TO_FREE 9

static struct twi_device *devices, *active, *stopping;
FAULT_SWITCH(twi_errors, "<=1000", NULL, 0) /* bytes in 1000 that arrive with a wrong bit */
static enum { IDLE, ADDRESS, WRITING_FIRST, WRITING, READING, REFUSED } phase;
static bool owns_bus;    /* a start condition was sent */
static uint8_t status;   /* at the end of the operation under way */
static int read_byte = -1; /* for TWDR at the end of the operation; -1: none */
static avr_cycle_count_t bus_free_at;
static enum { GOOD_LINES, DATA_STUCK, DATA_STUCK_FOREVER, CLOCK_STUCK } line;
static unsigned clocks; /* made by hand while the TWI is off */

static unsigned bit_cycles(void)
{
	static const unsigned prescale[4] = { 1, 4, 16, 64 };

	return 16u + 2u * avr->data[TWBR] * prescale[avr->data[TWSR] & 3];
}

static void set_status(uint8_t value)
{
	avr->data[TWSR] = (uint8_t)((avr->data[TWSR] & 3) | value);
}

static void release(void)
{
	active = NULL;
	owns_bus = false;
	phase = IDLE;
	set_status(STATUS_IDLE);
}

static avr_cycle_count_t done(avr_t *a, avr_cycle_count_t when, void *param)
{
	if (line != GOOD_LINES && status == STATUS_READ + NOT_ACKNOWLEDGED) {
		release(); /* the master's NACK reads back as an ACK */
		status = STATUS_LOST;
	}
	set_status(status);
	if (read_byte >= 0)
		a->data[TWDR] = (uint8_t)read_byte;
	read_byte = -1;
	avr_raise_interrupt(a, vector(VECTOR));
	return 0;
}

static avr_cycle_count_t stopped(avr_t *a, avr_cycle_count_t when, void *param)
{
	a->data[TWCR] &= (uint8_t)~TWSTO;
	if (stopping && stopping->part.model->stop)
		stopping->part.model->stop(stopping);
	stopping = NULL;
	return 0;
}

static void operate(unsigned bits, uint8_t result)
{
	status = result;
	if (line != CLOCK_STUCK) /* else it never ends */
		avr_cycle_timer_register(avr, bits * bit_cycles() + (active ? active->stretch : 0), done, NULL);
}

static void operate_byte(uint8_t result, bool acknowledged)
{
	operate(BITS_PER_BYTE, acknowledged ? result : result + NOT_ACKNOWLEDGED);
}

static void start(void)
{
	unsigned wait = 0;

	if (line != GOOD_LINES)
		return; /* SDA does not rise: no start condition */
	if (!owns_bus && avr->cycle < bus_free_at)
		wait = (unsigned)((bus_free_at - avr->cycle + bit_cycles() - 1) / bit_cycles());
	active = NULL;
	operate(1 + wait, owns_bus ? STATUS_REPEATED_START : STATUS_START);
	owns_bus = true;
	phase = ADDRESS;
}

static void stop(void)
{
	stopping = active;
	release();
	if (line != GOOD_LINES)
		return; /* SDA does not rise: no stop condition */
	avr_cycle_timer_register(avr, bit_cycles(), stopped, NULL);
	bus_free_at = avr->cycle + bit_cycles() + bit_cycles() / 2;
}

static bool acknowledges(struct twi_device *d, uint8_t called, bool reading)
{
	const struct model *m = d->part.model;

	if (d->address != called || !part_is_here(&d->part) || (m->start && !m->start(d, reading)))
		return false;
	d->stretch = US(d->part.fault.value == STRETCH ? m->fault_stretch_us : m->stretch_us);
	return true;
}

static void address(uint8_t byte)
{
	bool reading = byte & 1;

	for (struct twi_device *d = devices; d && !active; d = d->next)
		if (acknowledges(d, byte >> 1, reading))
			active = d;
	phase = !active ? REFUSED : reading ? READING : WRITING_FIRST;
	operate_byte(reading ? STATUS_READ_ADDRESS : STATUS_WRITE_ADDRESS, active);
}

/* A device holds SDA low: a one that the master sends reads back as a zero, as if another master had won the
 * arbitration. */
static void lose_arbitration(uint8_t byte)
{
	unsigned zeros = 0;

	while (!(byte & (0x80u >> zeros)))
		zeros++;
	release();
	operate(zeros + 1, STATUS_LOST);
}

static void transfer(uint8_t control)
{
	uint8_t byte = avr->data[TWDR];

	if ((line == DATA_STUCK || line == DATA_STUCK_FOREVER) && phase != READING && byte) {
		lose_arbitration(byte);
		return;
	}
	switch (phase) {
	case ADDRESS: address(byte); break;
	case WRITING_FIRST:
	case WRITING:
		byte = disturbed(byte, twi_errors.value);
		operate_byte(STATUS_WRITE, active->part.model->write(active, byte, phase == WRITING_FIRST));
		phase = WRITING;
		break;
	case READING:
		read_byte = line == GOOD_LINES ? disturbed(active->part.model->read(active), twi_errors.value) : 0;
		operate_byte(STATUS_READ, control & TWEA);
		break;
	case REFUSED: operate_byte(STATUS_WRITE, false); break;
	case IDLE: break;
	}
}

static void disable(void)
{
	avr_cycle_timer_cancel(avr, done, NULL);
	avr_clear_interrupt(avr, vector(VECTOR));
	release();
	avr_cycle_timer_cancel(avr, stopped, NULL);
	stopping = NULL;
	avr->data[TWCR] = 0;
	clocks = 0;
}

static void write_control(avr_t *a, avr_io_addr_t register_address, uint8_t value, void *param)
{
	uint8_t flag = a->data[TWCR] & TWINT;

	a->data[TWCR] = (uint8_t)((value & 0x75) | (value & TWINT ? 0 : flag));
	if (!(value & TWEN)) {
		disable();
	} else if (!(value & TWINT)) {
		if ((value & TWIE) && flag && !vector(VECTOR)->pending)
			avr_raise_interrupt(a, vector(VECTOR));
	} else {
		avr_clear_interrupt(a, vector(VECTOR));
		a->data[TWCR] &= (uint8_t)~TWINT;
		if (value & TWSTO)
			stop();
		if (value & TWSTA)
			start();
		else if (owns_bus)
			transfer(value);
	}
}

static void write_status(avr_t *a, avr_io_addr_t register_address, uint8_t value, void *param)
{
	a->data[register_address] = (uint8_t)((a->data[register_address] & 0xF8) | (value & 3));
}

/* A part holds a line low, or leaves it to its pull-up. */
static void hold(uint8_t pin, bool low)
{
	if (low)
		drive_pin('D', pin, false);
	else
		release_pin('D', pin);
}

static void set_line(unsigned fault)
{
	line = fault;
	hold(1, fault == DATA_STUCK || fault == DATA_STUCK_FOREVER);
	hold(0, fault == CLOCK_STUCK);
}

/* With the TWI off, the program can clock the bus by hand: a one in DDRD drives a line low. */
static void lines_changed(struct avr_irq_t *irq, uint32_t value, void *param)
{
	static bool was_low;
	bool low = value & SCL;

	if (!(avr->data[TWCR] & TWEN) && was_low && !low && ++clocks >= CLOCKS_TO_FREE && line == DATA_STUCK) {
		set_line(GOOD_LINES);
		bench_trace("sda released");
	}
	was_low = low;
}

void twi_init(void)
{
	take_register(TWCR, NULL, write_control);
	take_register(TWSR, NULL, write_status);
	avr->io[AVR_DATA_TO_IO(TWDR)].r.c = NULL; /* a byte of memory */
	avr->io[AVR_DATA_TO_IO(TWDR)].w.c = NULL;
	avr_irq_t *port = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), IOPORT_IRQ_DIRECTION_ALL);

	avr_irq_register_notify(port, lines_changed, NULL);
}

void twi_reset(void)
{
	release();
	stopping = NULL;
	read_byte = -1;
	bus_free_at = 0;
	clocks = 0;
	avr->data[TWDR] = 0xFF;
}

void twi_add(struct twi_device *device)
{
	device->next = devices;
	devices = device;
}

/* A stop or start that waited for SDA to rise goes on when the lines are good. */
static void change_line(unsigned fault)
{
	uint8_t control = avr->data[TWCR];

	set_line(fault);
	if (fault != GOOD_LINES || !(control & TWEN))
		return;
	if (control & TWSTO)
		stop();
	if ((control & TWSTA) && !owns_bus)
		start();
}

static void data_changed(void *self, unsigned before)
{
	change_line(((struct fault_switch *)self)->value);
}
FAULT_SWITCH(sda, "ok stuck stuck_forever", data_changed, GOOD_LINES)

static void clock_changed(void *self, unsigned before)
{
	change_line(((struct fault_switch *)self)->value ? CLOCK_STUCK : GOOD_LINES);
}
FAULT_SWITCH(scl, "ok stuck", clock_changed, GOOD_LINES)
