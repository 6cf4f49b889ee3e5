/* SPDX-License-Identifier: GPL-3.0-or-later
 * The bench protocol (host/docs/design/bench.md): rows, host bytes and faults in; board bytes, traces and acknowledgements out. */
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <simavr/sim_cycle_timers.h>

#include "twin.h"

#define MAX_RECORD (1u << 20)
#define SYNC_PULSE US(1000)

#define COUNTS_PER_GYRO_COUNT (0.2439 / 0.035)
#define COUNTS_PER_G 4098
#define NORTH_COUNTS 1368 /* 0.2 gauss to the north, level */

struct row row;
struct axes motion[3], motion_before[3];
int16_t field[3];

static enum pair { NONE, RANGERS, THIGH_CALF, THIGH_BELT, CALF_BELT, PAIRS } swapped;

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

/* With a pulse ranger on the left, its echo line is where SyncOut would be; on a foot board it is the data-ready line. */
static void set_sync(bool level)
{
	if (kit_of_papers(PLACE_RANGER_LEFT))
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
	if (kit_of_papers(PLACE_RANGER_LEFT))
		bench_trace("sync");
	avr_cycle_timer_register(a, SYNC_PULSE, sync_fall, NULL);
	return 0;
}

/* A sleeping processor passes time up to the next timer: none may lie beyond the end of the millisecond. */
static avr_cycle_count_t millisecond_ended(avr_t *a, avr_cycle_count_t when, void *param)
{
	(void)a;
	(void)when;
	(void)param;
	return 0;
}

static void run_millisecond(avr_cycle_count_t end)
{
	if (!board_runs()) {
		avr->cycle = end;
		return;
	}
	miso_millisecond();
	if (row.sync_us != NO_SYNC)
		avr_cycle_timer_register(avr, clock_cycles(row.sync_us) + 1, sync_rise, NULL);
	if (avr->cycle < end)
		avr_cycle_timer_register(avr, end - avr->cycle, millisecond_ended, NULL);
	while (avr->cycle < end) {
		int state = avr_run(avr);

		if (state == cpu_Done || state == cpu_Crashed)
			fail("the firmware %s at %.6f s", state == cpu_Done ? "stopped" : "crashed", (double)time_ns() * 1e-9);
	}
}

static void swap16(void *a, void *b)
{
	uint16_t kept;

	memcpy(&kept, a, 2);
	memcpy(a, b, 2);
	memcpy(b, &kept, 2);
}

static void swap_gyros(int a, int b)
{
	struct axes kept = motion[a];

	motion[a] = motion[b];
	motion[b] = kept;
	swap16(&row.rate[a], &row.rate[b]);
}

/* The plugs of two sensors are exchanged. */
static void swap_sensors(void)
{
	switch (swapped) {
	case RANGERS:
		swap16(&row.own_us[0], &row.own_us[1]);
		swap16(&row.cross_us[0], &row.cross_us[1]);
		break;
	case THIGH_CALF: swap_gyros(0, 1); break;
	case THIGH_BELT: swap_gyros(0, 2); break;
	case CALF_BELT: swap_gyros(1, 2); break;
	default: break;
	}
}

bool bench_swap(const char *value)
{
	static const char *const names[PAIRS] = { "none", "rangers", "thigh_calf", "thigh_belt", "calf_belt" };

	for (int k = 0; k < PAIRS; k++)
		if (!strcmp(value, names[k])) {
			swapped = (enum pair)k;
			return true;
		}
	return false;
}

/* What parts of more axes measure where the row has only those of the papers: rates about z, z up, a field by the bearing. */
static void extend_row(void)
{
	double bearing = row.bearing * 3.14159265358979 / 1800.0;

	memset(motion, 0, sizeof motion);
	for (int k = 0; k < 3; k++) {
		motion[k].rate[2] = (int16_t)lround(row.rate[k] * COUNTS_PER_GYRO_COUNT);
		motion[k].force[2] = COUNTS_PER_G;
	}
	field[0] = (int16_t)lround(NORTH_COUNTS * cos(bearing));
	field[1] = (int16_t)lround(NORTH_COUNTS * sin(bearing));
	field[2] = -2 * NORTH_COUNTS;
}

static void take_extended_row(const uint8_t *bytes)
{
	struct extended_row whole;

	memcpy(&whole, bytes, sizeof whole);
	row = whole.row;
	memcpy(motion, whole.motion, sizeof motion);
	memcpy(field, whole.field, sizeof field);
}

/* Runs one millisecond per row. */
static void advance(const uint8_t *rows, uint32_t length, bool extended)
{
	uint32_t size = extended ? sizeof(struct extended_row) : ROW_SIZE;

	if (length % size)
		fail("a record of rows has %u bytes, not a multiple of %u", length, size);
	for (uint32_t offset = 0; offset < length; offset += size) {
		memcpy(motion_before, motion, sizeof motion);
		if (extended) {
			take_extended_row(rows + offset);
		} else {
			memcpy(&row, rows + offset, ROW_SIZE);
			extend_row();
		}
		swap_sensors();
		run_millisecond(clock_next_millisecond());
		if (pty_wanted())
			pty_poll();
	}
	put_record('A', NULL, 0);
	flush();
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
		case 'R': advance(body, head.length, false); break;
		case 'E': advance(body, head.length, true); break;
		case 'H': usb_host_send(body, head.length); break;
		case 'F': switch_fault((char *)body); break;
		case 'Q': flush(); return;
		default: fail("unknown record 0x%02x", head.kind);
		}
	}
	fail("the input ends without a record Q");
}
