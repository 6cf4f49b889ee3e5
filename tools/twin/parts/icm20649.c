/* SPDX-License-Identifier: GPL-3.0-or-later
 * ICM-20649 of a foot board, at the thigh's chip select (PB4), INT1 on PD4 [ICM-20649 data sheet DS-000192]: SPI mode 0 or 3, at most 7 MHz,
 * the address first, then bytes whose addresses count up; four user banks. Rates of 4000 deg/s have 8.2 counts per deg/s, forces of 30 g 1024
 * per g; other ranges are scaled from those.
 *
 * The counts are those of the row's thigh, between this millisecond's and the one before, at the moment of the sample by the part's own clock.
 * No FIFO: the program reads the registers of the newest sample, and one that is not read in time is overwritten. */
#include <math.h>
#include <string.h>

#include <simavr/sim_cycle_timers.h>

#include "twin.h"

enum { WHO_AM_I = 0x00, PWR_MGMT_1 = 0x06, INT_ENABLE_1 = 0x11, INT_STATUS_1 = 0x1A, OUT = 0x2D, BANK_SEL = 0x7F, REGISTERS = 0x80, BANKS = 4 };
enum { GYRO_SMPLRT_DIV = 0x00, GYRO_CONFIG_1 = 0x01, ACCEL_CONFIG = 0x14 }; /* of bank 2 */
enum { DEVICE_RESET = 0x80, SLEEP = 0x40, RAW_DATA_READY = 1 };
#define IDENTITY 0xE1
#define OTHER_IDENTITY 0xEA /* an ICM-20948 */
#define MAX_HERTZ 7000000u
#define RISE_NS 210u /* to 0.7 VDDIO, by 10 kohm and at most 50 pF behind the breakout's BSS138, computed */
#define START_UP US(11000)
#define GYROS_ON US(35000)
#define INT_PULSE US(50)
#define CYCLES_AT_1125_HZ 14222.2
#define OWN_CLOCK 0.01 /* largest error of it */
#define FULL_SCALE 32767
#define FULL_SCALE_30_G 30720

static struct spi_device spi;
static enum fault { GOOD, ABSENT, ZEROS, WRONG_IDENTITY, NEVER_READY, STUCK_READY, STUCK, SATURATED, FAULTS } fault;
static const char *const fault_names[FAULTS] = { "ok", "absent", "zeros", "wrong_identity", "never_ready", "stuck_ready", "stuck", "saturated" };
static uint8_t registers[BANKS][REGISTERS], out[14];
static uint8_t bank, address, count;
static bool reading, garbled, sampling;
static avr_cycle_count_t up_at;
static double own_clock; /* cycles of the processor for each of its own, drawn when it is first plugged in */

static bool is_here(void)
{
	return kit_has_foot() && fault != ABSENT && avr->cycle >= up_at && !garbled;
}

static void set_line(bool level)
{
	if (kit_has_foot() && fault == ABSENT)
		floating_pin('D', 4, true);
	else if (kit_has_foot())
		drive_pin('D', 4, level || fault == STUCK_READY);
}

static int between(int16_t before, int16_t now)
{
	return (int)lround(before + (now - before) * clock_fraction());
}

static void put(int word, double value, int limit)
{
	int counts = value > limit ? limit : value < -limit ? -limit : (int)lround(value);

	out[2 * word] = (uint8_t)((unsigned)counts >> 8);
	out[2 * word + 1] = (uint8_t)counts;
}

/* Full scale of a configuration register: 0 is an eighth of 3. */
static double scale(uint8_t at)
{
	return (double)(8u >> ((registers[2][at] >> 1) & 3));
}

static void sample(void)
{
	for (int k = 0; k < 3; k++) {
		put(k, fault == SATURATED ? 1e6 : scale(ACCEL_CONFIG) * between(motion_before[0].force[k], motion[0].force[k]),
		    registers[2][ACCEL_CONFIG] & 6 ? FULL_SCALE_30_G : FULL_SCALE);
		put(3 + k, fault == SATURATED ? 1e6 : scale(GYRO_CONFIG_1) * between(motion_before[0].rate[k], motion[0].rate[k]), FULL_SCALE);
	}
	put(6, (row.temperature / 20.0 - 21.0) * 333.87, FULL_SCALE);
}

static avr_cycle_count_t line_falls(avr_t *a, avr_cycle_count_t when, void *param)
{
	(void)a;
	(void)when;
	(void)param;
	set_line(false);
	return 0;
}

static avr_cycle_count_t period(void)
{
	return (avr_cycle_count_t)(CYCLES_AT_1125_HZ * own_clock * (1 + registers[2][GYRO_SMPLRT_DIV]));
}

static avr_cycle_count_t next_sample(avr_t *a, avr_cycle_count_t when, void *param)
{
	(void)param;
	if (registers[0][PWR_MGMT_1] & SLEEP) {
		sampling = false;
		return 0;
	}
	if (fault != STUCK)
		sample();
	if ((registers[0][INT_ENABLE_1] & RAW_DATA_READY) && fault != NEVER_READY && fault != STUCK_READY && is_here()) {
		set_line(true);
		bench_trace("foot");
		avr_cycle_timer_register(a, INT_PULSE, line_falls, NULL);
	}
	return when + period();
}

static void wake(void)
{
	sampling = true;
	avr_cycle_timer_cancel(avr, next_sample, NULL);
	avr_cycle_timer_register(avr, GYROS_ON, next_sample, NULL);
}

static void restart(avr_cycle_count_t after)
{
	memset(registers, 0, sizeof registers);
	registers[0][PWR_MGMT_1] = SLEEP | 1;
	registers[2][GYRO_CONFIG_1] = registers[2][ACCEL_CONFIG] = 1;
	bank = 0;
	sampling = false;
	avr_cycle_timer_cancel(avr, next_sample, NULL);
	up_at = avr->cycle + after;
}

static void write_register(uint8_t at, uint8_t value)
{
	if (at == BANK_SEL) {
		bank = (value >> 4) & 3;
		return;
	}
	if (bank == 0 && (at == WHO_AM_I || at >= INT_STATUS_1))
		return;
	if (bank == 0 && at == PWR_MGMT_1 && (value & DEVICE_RESET)) {
		restart(START_UP);
		return;
	}
	registers[bank][at] = value;
	if (bank == 0 && at == PWR_MGMT_1 && !(value & SLEEP) && !sampling)
		wake();
}

static uint8_t value_at(uint8_t at)
{
	if (at == BANK_SEL)
		return (uint8_t)(bank << 4);
	if (bank == 0 && at == WHO_AM_I)
		return fault == WRONG_IDENTITY ? OTHER_IDENTITY : IDENTITY;
	if (bank == 0 && at >= OUT && at < OUT + sizeof out)
		return out[at - OUT];
	return registers[bank][at % REGISTERS];
}

static void on_select(struct spi_device *self, bool on)
{
	(void)self;
	count = 0;
	garbled = spi_hertz() > MAX_HERTZ || spi_outruns(RISE_NS);
	if (on && garbled && kit_has_foot())
		bench_trace("icm20649 clock too fast");
}

static int on_exchange(struct spi_device *self, uint8_t sent)
{
	uint8_t byte = spi_at_rising_edges(sent);

	(void)self;
	if (fault == ZEROS && kit_has_foot())
		return 0;
	if (!is_here())
		return SPI_OPEN;
	if (count++ == 0) {
		reading = byte & 0x80;
		address = byte & 0x7F;
		return SPI_OPEN;
	}
	count = 1;
	if (reading)
		return spi_answer(value_at(address++));
	if (spi_mode() != 0 && spi_mode() != 3)
		bench_trace("icm20649 misreads a frame: 0x%02x to register 0x%02x", byte, address);
	write_register(address++, byte);
	return SPI_OPEN;
}

void icm20649_power(void)
{
	if (!spi.select) {
		spi = (struct spi_device){ 'B', 4, on_select, on_exchange, false, NULL };
		spi_add(&spi);
	}
	if (own_clock == 0.0 && kit_has_foot())
		own_clock = 1.0 + OWN_CLOCK * ((int)random_below(2001) - 1000) / 1000.0;
	restart(START_UP);
	set_line(false);
}

/* After a reset of the processor simavr has lost the timers; the part goes on. */
void icm20649_resume(void)
{
	set_line(false);
	if (sampling && kit_has_foot())
		avr_cycle_timer_register(avr, period(), next_sample, NULL);
}

unsigned icm20649_plugged(void)
{
	return kit_has_foot() && fault != ABSENT;
}

bool icm20649_fault(const char *name, const char *value)
{
	for (int f = 0; !strcmp(name, "icm20649") && f < FAULTS; f++)
		if (!strcmp(value, fault_names[f])) {
			bool plugged = fault == ABSENT && f != ABSENT;

			fault = (enum fault)f;
			if (plugged || fault == ABSENT)
				restart(START_UP);
			set_line(false);
			return true;
		}
	return false;
}
