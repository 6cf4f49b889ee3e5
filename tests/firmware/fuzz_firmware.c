/* SPDX-License-Identifier: MIT */
/* Runs the whole portable firmware on a board that does what the input says: bytes from the host, answers of the chips,
 * outcomes of I2C transfers, edges, time. main.c is compiled with -Dmain=firmware_main; its loop ends with the input.
 * With libFuzzer only (make fuzz). */
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

#include "stub_board.h"

int firmware_main(void);
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length);

static const uint8_t *input;
static size_t left;
static jmp_buf end;
static uint32_t now;
static struct twi_transfer *under_way;

uint8_t stub_input(void)
{
	if (!left)
		longjmp(end, 1);
	left--;
	return *input++;
}

uint32_t clock_now(void) { return now++; }

void board_sleep(uint32_t wake_ticks)
{
	uint8_t how = stub_input();
	if (under_way && (how & 0x40)) {
		for (uint8_t n = 0; n < under_way->read_length; n++)
			under_way->bytes[n] = stub_input();
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

bool twi_watch(uint32_t at)
{
	(void)at;
	if (!under_way || stub_input() & 0xF)
		return false;
	under_way->state = TWI_FAILED;
	under_way = 0;
	return true;
}

void usb_run(void) {}
bool usb_is_open(void) { return true; }
bool usb_take_opening(void) { return !(stub_input() & 0x3F); }
bool usb_write(const uint8_t *bytes, uint8_t length)
{
	static uint8_t sent[255];
	memcpy(sent, bytes, length);
	return length < 250;
}
int16_t usb_read(void) { uint8_t byte = stub_input(); return byte & 1 ? (int16_t)stub_input() : (int16_t)-1; }

bool capture_take_edge(struct capture_edge *out)
{
	*out = (struct capture_edge){ now, stub_input(), 0 };
	return out->edge & 1;
}

bool adc_take(uint16_t *reading) { *reading = (uint16_t)(stub_input() * 4); return *reading & 4; }
void board_start(void) {}
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
