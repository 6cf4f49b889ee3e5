/* SPDX-License-Identifier: GPL-3.0-or-later
 * Chips with a file of registers. On SPI, in mode 0 or 3, the first byte of a frame has the address and the bit 0x80 of
 * a read; on I2C the first byte of a write has the address. */
#include "parts/parts.h"

#define READ 0x80
#define COUNTS_UP 0x80
#define REGISTERS 0x80

void registers_select(void *self, bool on)
{
	struct register_file *f = self;

	f->count = 0;
	f->garbled = spi_outruns(f->part.model->rise_ns);
	if (on && f->garbled && part_is_plugged(&f->part))
		bench_trace("%s clock too fast", f->part.fault.name);
}

bool registers_answer(const struct register_file *f)
{
	return part_is_here(&f->part) && avr->cycle >= f->up_at && !f->garbled;
}

static int read_byte(struct register_file *f)
{
	const struct model *m = f->part.model;

	if (f->count <= 1 + m->dummy_bytes || f->address >= REGISTERS)
		return 0;
	return spi_answer(m->get(f, f->address++));
}

static void write_byte(struct register_file *f, uint8_t byte)
{
	if (spi_mode() != 0 && spi_mode() != 3)
		bench_trace("%s misreads a frame: 0x%02x to register 0x%02x", f->part.fault.name, byte, f->address);
	if (f->address < REGISTERS)
		f->part.model->set(f, f->address++, byte);
}

int registers_exchange(void *self, uint8_t sent)
{
	struct register_file *f = self;
	uint8_t byte = spi_at_rising_edges(sent);

	if (f->part.fault.value && f->part.fault.value == f->part.model->zeros && part_is_plugged(&f->part))
		return 0;
	if (!registers_answer(f))
		return SPI_OPEN;
	if (f->count++ == 0) {
		f->reading = byte & READ;
		f->address = byte & (REGISTERS - 1);
		return SPI_OPEN;
	}
	if (f->reading)
		return read_byte(f);
	write_byte(f, byte);
	return SPI_OPEN;
}

static uint8_t next_address(struct register_file *f)
{
	uint8_t address = f->address;

	if (f->counts_up)
		f->address = (uint8_t)(address + 1) & f->part.model->address_mask;
	return address;
}

bool registers_write(void *self, uint8_t byte, bool first)
{
	struct register_file *f = self;
	const struct model *m = f->part.model;

	if (first) {
		f->address = byte & m->address_mask;
		f->counts_up = (byte | m->address_mask) & COUNTS_UP;
	} else if (m->set) {
		m->set(f, next_address(f), byte);
	}
	return f->part.fault.value != NACK;
}

uint8_t registers_read(void *self)
{
	struct register_file *f = self;

	return (uint8_t)f->part.model->get(f, next_address(f));
}
