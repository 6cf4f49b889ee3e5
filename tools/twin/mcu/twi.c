/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two-wire interface, master mode [ATmega32U4 data sheet, chapter 20]: bit timing of TWBR and TWSR, devices on the bus, clock
 * stretching, an SDA line that a device may hold low until it has received nine clocks, and an SCL line that one may hold low. */
#include <simavr/avr_ioport.h>
#include <simavr/sim_cycle_timers.h>
#include <simavr/sim_interrupts.h>

#include "twin.h"

enum { TWBR = 0xB8, TWSR, TWAR, TWDR, TWCR };
enum { TWINT = 0x80, TWEA = 0x40, TWSTA = 0x20, TWSTO = 0x10, TWEN = 4, TWIE = 1 };
enum { DDRD = 0x2A, SCL = 1, SDA = 2 };
enum { /* status codes [data sheet, tables 20-3 and 20-4] */
	STATUS_START = 0x08,
	STATUS_REPEATED_START = 0x10,
	STATUS_WRITE_ADDRESS_ACK = 0x18,
	STATUS_WRITE_ADDRESS_NACK = 0x20,
	STATUS_WRITE_ACK = 0x28,
	STATUS_WRITE_NACK = 0x30,
	STATUS_LOST = 0x38,
	STATUS_READ_ADDRESS_ACK = 0x40,
	STATUS_READ_ADDRESS_NACK = 0x48,
	STATUS_READ_ACK = 0x50,
	STATUS_READ_NACK = 0x58,
	STATUS_IDLE = 0xF8,
};
#define VECTOR 36
#define BITS_PER_BYTE 9 /* with the acknowledge */
#define CLOCKS_TO_FREE 9

static struct twi_device *devices, *active, *stopping;
static unsigned errors; /* bytes in 1000 that arrive with a wrong bit */
static enum { IDLE, ADDRESS, WRITING, READING, REFUSED } phase;
static bool owns_bus;    /* a start condition was sent */
static uint8_t status;   /* at the end of the operation under way */
static int read_byte = -1; /* for TWDR at the end of the operation; -1: none */
static avr_cycle_count_t bus_free_at;
static enum twi_fault line;
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
	(void)when;
	(void)param;
	if (line != TWI_GOOD && status == STATUS_READ_NACK) {
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
	(void)when;
	(void)param;
	a->data[TWCR] &= (uint8_t)~TWSTO;
	if (stopping && stopping->stop)
		stopping->stop(stopping);
	stopping = NULL;
	return 0;
}

static void operate(unsigned bits, uint8_t result)
{
	uint32_t stretch = active ? active->stretch : 0;

	status = result;
	if (line == TWI_CLOCK_STUCK)
		return; /* it never ends */
	avr_cycle_timer_register(avr, bits * bit_cycles() + stretch, done, NULL);
}

static void start(void)
{
	unsigned wait = 0;

	if (line != TWI_GOOD)
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
	if (line != TWI_GOOD)
		return; /* SDA does not rise: no stop condition */
	avr_cycle_timer_register(avr, bit_cycles(), stopped, NULL);
	bus_free_at = avr->cycle + bit_cycles() + bit_cycles() / 2;
}

bool twi_errors(const char *value)
{
	return set_errors(&errors, value);
}

static void address(uint8_t byte)
{
	bool reading = byte & 1, ack = false;

	for (struct twi_device *d = devices; d && !ack; d = d->next)
		if (d->address == byte >> 1 && d->start(d, reading)) {
			active = d;
			ack = true;
		}
	phase = !ack ? REFUSED : reading ? READING : WRITING;
	if (reading)
		operate(BITS_PER_BYTE, ack ? STATUS_READ_ADDRESS_ACK : STATUS_READ_ADDRESS_NACK);
	else
		operate(BITS_PER_BYTE, ack ? STATUS_WRITE_ADDRESS_ACK : STATUS_WRITE_ADDRESS_NACK);
}

/* A device holds SDA low: a one that the master sends reads back as a zero, as if another master had won the arbitration. */
static void lose_arbitration(uint8_t byte)
{
	unsigned zeros = 0;

	while (!(byte & (0x80u >> zeros)))
		zeros++;
	active = NULL;
	owns_bus = false;
	phase = IDLE;
	operate(zeros + 1, STATUS_LOST);
}

static void transfer(uint8_t control)
{
	uint8_t byte = avr->data[TWDR];

	if ((line == TWI_STUCK || line == TWI_STUCK_FOREVER) && phase != READING && byte) {
		lose_arbitration(byte);
		return;
	}
	switch (phase) {
	case ADDRESS: address(byte); break;
	case WRITING: operate(BITS_PER_BYTE, active->write(active, disturbed(byte, errors)) ? STATUS_WRITE_ACK : STATUS_WRITE_NACK); break;
	case READING:
		read_byte = line == TWI_GOOD ? disturbed(active->read(active), errors) : 0;
		operate(BITS_PER_BYTE, control & TWEA ? STATUS_READ_ACK : STATUS_READ_NACK);
		break;
	case REFUSED: operate(BITS_PER_BYTE, STATUS_WRITE_NACK); break;
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

	(void)register_address;
	(void)param;
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
	(void)param;
	a->data[register_address] = (uint8_t)((a->data[register_address] & 0xF8) | (value & 3));
}

static void write_plain(avr_t *a, avr_io_addr_t register_address, uint8_t value, void *param)
{
	(void)param;
	a->data[register_address] = value;
}

static uint8_t read_plain(avr_t *a, avr_io_addr_t register_address, void *param)
{
	(void)a;
	(void)param;
	return avr->data[register_address];
}

/* The pins: a part that holds a line low; else the pull-ups. */
static void set_line(enum twi_fault fault)
{
	line = fault;
	if (fault == TWI_STUCK || fault == TWI_STUCK_FOREVER)
		drive_pin('D', 1, false);
	else
		release_pin('D', 1);
	if (fault == TWI_CLOCK_STUCK)
		drive_pin('D', 0, false);
	else
		release_pin('D', 0);
}

/* With the TWI off, the program can clock the bus by hand: a one in DDRD drives a line low. */
static void lines_changed(struct avr_irq_t *irq, uint32_t value, void *param)
{
	static uint8_t before;
	uint8_t driven = (uint8_t)value;

	(void)irq;
	(void)param;
	if (!(avr->data[TWCR] & TWEN) && (before & SCL) && !(driven & SCL) && ++clocks >= CLOCKS_TO_FREE && line == TWI_STUCK) {
		set_line(TWI_GOOD);
		bench_trace("sda released");
	}
	before = driven;
}

void twi_init(void)
{
	take_register(TWCR, NULL, write_control);
	take_register(TWSR, NULL, write_status);
	take_register(TWDR, read_plain, write_plain);
	avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), IOPORT_IRQ_DIRECTION_ALL), lines_changed, NULL);
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

void twi_fault(enum twi_fault fault)
{
	uint8_t control = avr->data[TWCR];

	set_line(fault);
	if (fault != TWI_GOOD || !(control & TWEN))
		return;
	if (control & TWSTO) /* a stop or start that waited for SDA to rise */
		stop();
	if ((control & TWSTA) && !owns_bus)
		start();
}
