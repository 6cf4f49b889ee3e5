/* SPDX-License-Identifier: GPL-3.0-or-later
 * The bench protocol (host/DESIGN.md): rows, host bytes and faults in; board bytes, traces and acknowledgements out. */
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <simavr/sim_cycle_timers.h>

#include "twin.h"

#define MAX_RECORD (1u << 20)
#define SYNC_PULSE US(1000)

struct row row;

static uint8_t out_buffer[1 << 16];
static unsigned out_length;
static int out_fd;

static void flush(void)
{
	unsigned written = 0;

	while (written < out_length) {
		ssize_t n = write(out_fd, out_buffer + written, out_length - written);

		if (n < 0 && errno == EINTR)
			continue;
		if (n <= 0)
			fail("cannot write the output: %s", strerror(errno));
		written += (unsigned)n;
	}
	out_length = 0;
}

static void put_record(char kind, const void *bytes, unsigned length)
{
	uint64_t now = time_ns();
	uint32_t size = length + 8;

	if (out_length + 13 + length > sizeof out_buffer)
		flush();
	out_buffer[out_length++] = (uint8_t)kind;
	memcpy(out_buffer + out_length, &size, 4);
	memcpy(out_buffer + out_length + 4, &now, 8);
	if (length)
		memcpy(out_buffer + out_length + 12, bytes, length);
	out_length += 12 + length;
}

void bench_sent(const uint8_t *bytes, unsigned length)
{
	if (!length)
		return;
	if (pty_wanted())
		pty_write(bytes, length);
	else
		put_record('B', bytes, length);
}

bool bench_has_room(void)
{
	return !pty_wanted() || pty_has_room();
}

void bench_trace(const char *format, ...)
{
	char text[160];
	va_list arguments;

	va_start(arguments, format);
	int length = vsnprintf(text, sizeof text, format, arguments);
	va_end(arguments);
	put_record('T', text, (unsigned)length < sizeof text ? (unsigned)length : sizeof text - 1);
}

/* Reads exactly `length` bytes; false: the input ended before the first of them. */
static bool read_all(int fd, void *into, size_t length)
{
	size_t done = 0;

	while (done < length) {
		ssize_t n = read(fd, (char *)into + done, length - done);

		if (n < 0 && errno == EINTR)
			continue;
		if (n < 0)
			fail("cannot read the input: %s", strerror(errno));
		if (n == 0) {
			if (done == 0)
				return false;
			fail("the input ends in the middle of a record");
		}
		done += (size_t)n;
	}
	return true;
}

static void set_sync(bool level)
{
	drive_pin('D', 4, level);
}

/* Ends the SyncOut pulse under way, whose timer the reset has removed. */
void bench_reset(void)
{
	set_sync(false);
}

static avr_cycle_count_t sync_fall(avr_t *a, avr_cycle_count_t when, void *param)
{
	(void)a;
	(void)when;
	(void)param;
	set_sync(false);
	return 0;
}

static avr_cycle_count_t sync_rise(avr_t *a, avr_cycle_count_t when, void *param)
{
	(void)when;
	(void)param;
	set_sync(true);
	bench_trace("sync");
	avr_cycle_timer_register(a, SYNC_PULSE, sync_fall, NULL);
	return 0;
}

static void run_millisecond(avr_cycle_count_t end)
{
	if (!board_has_power()) {
		avr->cycle = end;
		return;
	}
	if (row.sync_us != NO_SYNC)
		avr_cycle_timer_register(avr, US(row.sync_us) + 1, sync_rise, NULL);
	while (avr->cycle < end) {
		int state = avr_run(avr);

		if (state == cpu_Done || state == cpu_Crashed)
			fail("the firmware %s at %.6f s", state == cpu_Done ? "stopped" : "crashed", (double)time_ns() * 1e-9);
	}
}

/* Runs one millisecond per row. */
static void advance(const uint8_t *rows, uint32_t length)
{
	static avr_cycle_count_t end;

	if (length % ROW_SIZE)
		fail("a record of rows has %u bytes, not a multiple of %zu", length, ROW_SIZE);
	for (uint32_t offset = 0; offset < length; offset += ROW_SIZE) {
		memcpy(&row, rows + offset, ROW_SIZE);
		end += CYCLES_PER_MS;
		run_millisecond(end);
		if (pty_wanted())
			pty_poll();
	}
	put_record('A', NULL, 0);
	flush();
}

/* Switches that are no device's; false: no such switch. */
static bool board_fault(const char *name, const char *value)
{
	if (!strcmp(name, "usb")) {
		if (!strcmp(value, "unplug"))
			board_power(false);
		else if (!strcmp(value, "plug"))
			board_power(true);
		else if (!strcmp(value, "reset"))
			usb_host_reset();
		else
			return false;
	} else if (!strcmp(name, "host")) {
		usb_host_stall(!strcmp(value, "stall"));
		return !strcmp(value, "stall") || !strcmp(value, "read");
	} else if (!strcmp(name, "sda")) {
		bool forever = !strcmp(value, "stuck_forever");

		twi_fault(forever ? TWI_STUCK_FOREVER : !strcmp(value, "stuck") ? TWI_STUCK : TWI_GOOD);
		return forever || !strcmp(value, "stuck") || !strcmp(value, "ok");
	} else if (!strcmp(name, "reset")) {
		uint8_t cause = !strcmp(value, "power") ? 1 : !strcmp(value, "external") ? 2 : !strcmp(value, "watchdog") ? 8 : 0;

		if (cause)
			board_reset(cause);
		return cause != 0;
	} else {
		return false;
	}
	return true;
}

static void switch_fault(char *text)
{
	char *value = strchr(text, '=');

	if (!value)
		fail("fault '%s' is not name=value", text);
	*value++ = 0;
	if (!board_fault(text, value) && !srf02_fault(text, value) && !adis16100_fault(text, value) && !scp1000_fault(text, value) &&
	    !compass_fault(text, value))
		fail("there is no fault %s=%s; see tools/twin/README.md", text, value);
}

void bench_run(int in, int out)
{
	static uint8_t body[MAX_RECORD + 1];
	struct {
		uint8_t kind;
		uint32_t length;
	} __attribute__((packed)) head;

	out_fd = out;
	while (read_all(in, &head, sizeof head)) {
		if (head.length > MAX_RECORD)
			fail("a record of %u bytes is too long", head.length);
		if (head.length && !read_all(in, body, head.length))
			fail("the input ends in the middle of a record");
		body[head.length] = 0;
		switch (head.kind) {
		case 'R': advance(body, head.length); break;
		case 'H': usb_host_send(body, head.length); break;
		case 'F': switch_fault((char *)body); break;
		case 'Q': flush(); return;
		default: fail("unknown record 0x%02x", head.kind);
		}
	}
	fail("the input ends without a record Q");
}
