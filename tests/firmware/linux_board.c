/* SPDX-License-Identifier: MIT */
/* The portable firmware as a process in real time, whose USB port is a pseudo terminal: its name is printed. Two SRF02
 * and a CMPS10 answer on I2C, SyncOut pulses at 100 Hz; nothing else is there. `make -C firmware linux`. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "stub_board.h"

#define NS_PER_TICK 500
#define RANGING_TICKS (61u * TICKS_PER_MS)
#define SYNC_TICKS (10u * TICKS_PER_MS)

static int terminal;
static bool is_open, was_opened;
static struct {
	uint8_t address, registers[6], pointer;
	uint32_t busy_until; /* ticks */
} parts[] = {
	{ .address = 0x70, .registers = { 6, 0x80, 5831 >> 8, 5831 & 0xFF } }, /* us */
	{ .address = 0x71, .registers = { 6, 0x80, 7000 >> 8, 7000 & 0xFF } },
	{ .address = 0x60, .registers = { 1, 0, 900 >> 8, 900 & 0xFF } }, /* 0.1 degrees */
};

uint8_t stub_input(void) { return 0xFF; }

uint32_t clock_now(void)
{
	static time_t start_s;
	struct timespec t;
	clock_gettime(CLOCK_MONOTONIC, &t);
	start_s = start_s ? start_s : t.tv_sec;
	return (uint32_t)(t.tv_sec - start_s) * TICKS_PER_S + (uint32_t)(t.tv_nsec / NS_PER_TICK);
}

void board_start(void)
{
	terminal = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
	if (terminal < 0 || grantpt(terminal) || unlockpt(terminal))
		exit(1);
	struct termios settings;
	int other = open(ptsname(terminal), O_RDWR | O_NOCTTY);
	tcgetattr(other, &settings);
	cfmakeraw(&settings);
	tcsetattr(other, TCSANOW, &settings);
	close(other); /* from now on a hang-up means that no program has it open */
	puts(ptsname(terminal));
	fflush(stdout);
}

void board_sleep(uint32_t wake_ticks)
{
	int32_t ticks = (int32_t)(wake_ticks - clock_now());
	struct timespec t = { 0, ticks > 0 ? (long)ticks * NS_PER_TICK : 0 };
	struct pollfd p = { is_open ? terminal : -1, POLLIN, 0 };
	ppoll(&p, 1, &t, NULL);
}

void board_bootloader(void) { exit(0); }

void usb_run(void)
{
	struct pollfd p = { terminal, POLLIN, 0 };
	poll(&p, 1, 0);
	bool before = is_open;
	is_open = !(p.revents & POLLHUP);
	was_opened = was_opened || (is_open && !before);
}

bool usb_is_open(void) { return is_open; }

bool usb_take_opening(void)
{
	bool opened = was_opened;
	was_opened = false;
	return opened;
}

bool usb_write(const uint8_t *bytes, uint8_t length) { return write(terminal, bytes, length) == length; }

int16_t usb_read(void)
{
	uint8_t byte;
	return read(terminal, &byte, 1) == 1 ? (int16_t)byte : (int16_t)-1;
}

bool twi_begin(struct twi_transfer *t)
{
	t->ticks = clock_now();
	t->state = TWI_NACK;
	for (size_t k = 0; k < sizeof parts / sizeof *parts; k++) {
		if (parts[k].address != t->address || !ticks_reached(t->ticks, parts[k].busy_until))
			continue;
		t->state = TWI_DONE;
		if (t->write_length)
			parts[k].pointer = t->bytes[0];
		if (t->write_length == 2) /* a command */
			parts[k].busy_until = t->ticks + RANGING_TICKS;
		for (uint8_t n = 0; n < t->read_length; n++) {
			uint8_t at = parts[k].pointer++;
			t->bytes[n] = at < sizeof parts[k].registers ? parts[k].registers[at] : 0;
		}
	}
	return true;
}

bool twi_watch(uint32_t now) { (void)now; return false; }

bool capture_take_edge(struct capture_edge *out)
{
	static uint32_t last;
	uint32_t count = clock_now() / SYNC_TICKS, passed = count - last;
	*out = (struct capture_edge){ count * SYNC_TICKS, (uint16_t)count, (uint16_t)(passed - 1) };
	last = count;
	return passed;
}

bool adc_take(uint16_t *reading) { *reading = 225; return true; } /* 5.0 V */
