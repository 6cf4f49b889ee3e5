/* SPDX-License-Identifier: GPL-3.0-or-later
 * LIS3MDL magnetometer on I2C at 0x1C [LIS3MDL data sheet]: a sub-address whose upper bit makes the addresses count up; in continuous mode
 * it measures at 80 Hz. The counts are the row's field. */
#include <string.h>

#include "twin.h"

enum { WHO_AM_I = 0x0F, CTRL_REG1 = 0x20, CTRL_REG3 = 0x22, STATUS = 0x27, OUT = 0x28, REGISTERS = 0x40 };
enum { READY = 0x08, POWER_DOWN = 0x03 };
#define ADDRESS 0x1C
#define IDENTITY 0x3D
#define STRETCHED US(100)
#define FIRST_SAMPLE US(12500)
#define FULL_SCALE 32767

static struct twi_device twi;
static enum fault { GOOD, ABSENT, NACK, STRETCH, WRONG_IDENTITY, NEVER_READY, SATURATED, FAULTS } fault;
static const char *const fault_names[FAULTS] = { "ok", "absent", "nack", "stretch", "wrong_identity", "never_ready", "saturated" };
static uint8_t registers[REGISTERS], pointer;
static bool fresh, counts_up; /* the next byte written is a sub-address */
static avr_cycle_count_t ready_at;

static bool on_start(struct twi_device *self, bool read)
{
	if (!kit_of_2026(PLACE_COMPASS) || fault == ABSENT)
		return false;
	fresh = !read;
	self->stretch = fault == STRETCH ? STRETCHED : 0;
	return true;
}

static void advance(void)
{
	if (counts_up)
		pointer = (uint8_t)((pointer + 1) % REGISTERS);
}

static bool on_write(struct twi_device *self, uint8_t byte)
{
	(void)self;
	if (fresh) {
		pointer = byte & (REGISTERS - 1);
		counts_up = byte & 0x80;
		fresh = false;
		return fault != NACK;
	}
	if (pointer >= CTRL_REG1 && pointer < STATUS) {
		if (pointer == CTRL_REG3 && (registers[pointer] & POWER_DOWN) && !(byte & POWER_DOWN))
			ready_at = avr->cycle + FIRST_SAMPLE;
		registers[pointer] = byte;
	}
	advance();
	return true;
}

static uint8_t value(void)
{
	bool measures = !(registers[CTRL_REG3] & POWER_DOWN) && avr->cycle >= ready_at && fault != NEVER_READY;

	if (pointer == WHO_AM_I)
		return fault == WRONG_IDENTITY ? 0x40 : IDENTITY; /* a LIS2MDL */
	if (pointer == STATUS) {
		for (int k = 0; k < 3; k++) {
			int counts = fault == SATURATED ? FULL_SCALE : field[k];

			registers[OUT + 2 * k] = (uint8_t)counts;
			registers[OUT + 2 * k + 1] = (uint8_t)((unsigned)counts >> 8);
		}
		return measures ? READY : 0;
	}
	return registers[pointer];
}

static uint8_t on_read(struct twi_device *self)
{
	uint8_t found = value();

	(void)self;
	advance();
	return found;
}

void lis3mdl_power(void)
{
	if (!twi.start) {
		twi = (struct twi_device){ ADDRESS, on_start, on_write, on_read, NULL, 0, NULL };
		twi_add(&twi);
	}
	memset(registers, 0, sizeof registers);
	registers[CTRL_REG3] = POWER_DOWN;
}

bool lis3mdl_fault(const char *name, const char *text)
{
	if (strcmp(name, "lis3mdl"))
		return false;
	for (int f = 0; f < FAULTS; f++)
		if (!strcmp(text, fault_names[f])) {
			if (fault == ABSENT && f != ABSENT)
				lis3mdl_power(); /* plugged in again */
			fault = (enum fault)f;
			return true;
		}
	return false;
}
