/* SPDX-License-Identifier: MIT */
/* Runs the whole portable firmware on a board that does what the input says: bytes from the host, answers of the chips,
 * outcomes of I2C transfers, edges, time. main.c is compiled with -Dmain=firmware_main; its loop ends with the input.
 * With libFuzzer only (make fuzz). */
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

#include "board.h"

int firmware_main(void);
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length);

static const uint8_t *input;
static size_t left;
static jmp_buf end;
static uint32_t now;
static struct twi_transfer *under_way;

static uint8_t next(void)
{
	if (!left)
		longjmp(end, 1);
	left--;
	return *input++;
}

uint32_t clock_now(void) { return now++; }

void board_sleep(uint32_t wake_ticks)
{
	uint8_t how = next();
	if (under_way && (how & 0x40)) {
		for (uint8_t n = 0; n < under_way->read_length; n++)
			under_way->bytes[n] = next();
		under_way->ticks = now;
		under_way->state = TWI_DONE + how % 3;
		under_way = 0;
	}
	now = how & 0x80 ? now + ((uint32_t)how << 8) : wake_ticks;
}

bool twi_begin(struct twi_transfer *transfer)
{
	if (under_way)
		return false;
	if (transfer->write_length > 4 || transfer->read_length > sizeof transfer->bytes)
		abort();
	transfer->state = TWI_BUSY;
	under_way = transfer;
	return true;
}

enum twi_state twi_state(const struct twi_transfer *transfer) { return (enum twi_state)transfer->state; }

bool twi_watch(uint32_t at)
{
	(void)at;
	if (!under_way || next() & 0xF)
		return false;
	under_way->state = TWI_FAILED;
	under_way = 0;
	return true;
}

uint8_t spi_exchange(uint8_t out) { (void)out; return next(); }
uint8_t spi_begin(enum chip chip, enum spi_protocol protocol, uint8_t first)
{
	(void)chip, (void)protocol;
	return spi_exchange(first);
}
void spi_release(void) {}
void spi_write(enum chip chip, enum spi_protocol protocol, uint8_t address, uint8_t value)
{
	(void)chip, (void)protocol, (void)address, (void)value;
}
bool spi_pressure_ready(void) { return next() & 1; }
void spi_excite_gyros(enum excitation excitation) { (void)excitation; }

void usb_run(void) {}
bool usb_is_open(void) { return true; }
bool usb_take_opening(void) { return !(next() & 0x3F); }
bool usb_write(const uint8_t *bytes, uint8_t length)
{
	static uint8_t sent[255];
	memcpy(sent, bytes, length);
	return length < 250;
}
int16_t usb_read(void) { uint8_t byte = next(); return byte & 1 ? (int16_t)next() : (int16_t)-1; }
bool usb_bootloader_wanted(void) { return false; }
void usb_name_foot(void) {}
uint8_t usb_suspends(void) { return 0; }

bool capture_take_edge(struct capture_edge *out)
{
	*out = (struct capture_edge){ now, next(), 0 };
	return out->edge & 1;
}
bool capture_trigger(uint8_t side) { (void)side; return next() & 1; }
bool capture_pull_low(uint8_t side) { (void)side; return next() & 1; }
void capture_end_pulse(uint8_t side) { (void)side; }
enum capture_state capture_take_pulse(uint8_t side, struct capture_pulse *out)
{
	uint8_t how = next();
	(void)side;
	*out = (struct capture_pulse){ now - ((uint32_t)how << 8), now };
	return (enum capture_state)(how % 3);
}

uint8_t levels_read(void) { return next(); }
bool adc_take(uint16_t *reading) { *reading = (uint16_t)(next() * 4); return *reading & 4; }
const struct restart *restart_known(void) { static struct restart known; return &known; }
void restart_enter(uint8_t place) { (void)place; }
void restart_note_sag(bool sagging) { (void)sagging; }
void board_start(void) {}
void board_lamp(bool level) { (void)level; }
void board_take_timing(uint16_t *turn, uint16_t *latency) { *turn = *latency = 0; }
uint16_t board_memory_used(void) { return 0; }
void board_bootloader(void) { longjmp(end, 1); }

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length)
{
	input = bytes;
	left = length;
	if (!setjmp(end))
		(void)firmware_main();
	under_way = 0;
	return 0;
}
