/* SPDX-License-Identifier: GPL-3.0-or-later
 * The bench protocol (host/docs/design/bench.md): rows, host bytes and faults in; board bytes, traces and
 * acknowledgements out. */
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <simavr/sim_cycle_timers.h>

#include "parts/parts.h"

#define MAX_RECORD (1u << 20)
#define SYNC_PULSE US(1000)
#define COUNTS_PER_GYRO_COUNT (0.2439 / 0.035)
#define COUNTS_PER_G 4098
#define NORTH_COUNTS 1368 /* 0.2 gauss to the north, level */

enum { NONE, RANGERS, THIGH_CALF, THIGH_BELT, CALF_BELT };
FAULT_SWITCH(swapped, "none rangers thigh_calf thigh_belt calf_belt", NULL, NONE)

struct extended_row input, previous;
static FILE *out;

static void put_record(char kind, const void *bytes, unsigned length)
{
	struct {
		char kind;
		uint32_t size;
		uint64_t t_ns;
	} __attribute__((packed)) head = { kind, length + 8, time_ns() };

	fwrite(&head, sizeof head, 1, out);
	fwrite(bytes, 1, length, out);
}

static void flush(void)
{
	if (fflush(out) || ferror(out))
		fail("cannot write the output: %s", strerror(errno));
}

void bench_sent(const uint8_t *bytes, unsigned length)
{
	if (length && pty_wanted())
		pty_write(bytes, length);
	else if (length)
		put_record('B', bytes, length);
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
static bool read_all(void *into, size_t length)
{
	size_t done = fread(into, 1, length, stdin);

	if (ferror(stdin))
		fail("cannot read the input: %s", strerror(errno));
	if (done && done < length)
		fail("the input ends in the middle of a record");
	return done == length;
}

/* With a pulse ranger on the left, its echo line is where SyncOut would be; on a foot board it is the data-ready
 * line. */
void bench_sync(bool level)
{
	if (place_has(PLACE_RANGER_LEFT, OF_PAPERS))
		drive_pin('D', 4, level);
}

static avr_cycle_count_t sync_fall(avr_t *a, avr_cycle_count_t when, void *param)
{
	bench_sync(false);
	return 0;
}

static avr_cycle_count_t sync_rise(avr_t *a, avr_cycle_count_t when, void *param)
{
	bench_sync(true);
	if (place_has(PLACE_RANGER_LEFT, OF_PAPERS))
		bench_trace("sync");
	avr_cycle_timer_register(a, SYNC_PULSE, sync_fall, NULL);
	return 0;
}

/* A sleeping processor passes time up to the next timer: none may lie beyond the end of the millisecond. */
static avr_cycle_count_t millisecond_ended(avr_t *a, avr_cycle_count_t when, void *param)
{
	return 0;
}

static void run_millisecond(avr_cycle_count_t end)
{
	if (!board_runs()) {
		avr->cycle = end;
		return;
	}
	miso_millisecond();
	floating_millisecond();
	if (input.row.sync_us != NO_SYNC)
		avr_cycle_timer_register(avr, clock_cycles(input.row.sync_us) + 1, sync_rise, NULL);
	if (avr->cycle < end)
		avr_cycle_timer_register(avr, end - avr->cycle, millisecond_ended, NULL);
	while (avr->cycle < end) {
		int state = avr_run(avr);

		if (state == cpu_Done || state == cpu_Crashed)
			fail("the firmware %s at %.6f s", state == cpu_Done ? "stopped" : "crashed", (double)time_ns() * 1e-9);
	}
}

static void swap(void *a, void *b, size_t size)
{
	char kept[sizeof(struct axes)];

	memcpy(kept, a, size);
	memcpy(a, b, size);
	memcpy(b, kept, size);
}

/* The plugs of two sensors are exchanged. */
static void swap_sensors(void)
{
	static const int gyros[][2] = { [THIGH_CALF] = { 0, 1 }, [THIGH_BELT] = { 0, 2 }, [CALF_BELT] = { 1, 2 } };
	int a = gyros[swapped.value][0], b = gyros[swapped.value][1];

	if (swapped.value == RANGERS) {
		swap(&input.row.own_us[0], &input.row.own_us[1], sizeof *input.row.own_us);
		swap(&input.row.cross_us[0], &input.row.cross_us[1], sizeof *input.row.cross_us);
	} else if (swapped.value != NONE) {
		swap(&input.motion[a], &input.motion[b], sizeof *input.motion);
		swap(&input.row.rate[a], &input.row.rate[b], sizeof *input.row.rate);
	}
}

/* What parts of more axes measure where the row has only those of the papers: rates about z, z up, a field by the
 * bearing. */
static void extend_row(void)
{
	double bearing = input.row.bearing * 3.14159265358979 / 1800.0;

	memset(input.motion, 0, sizeof input.motion);
	for (int k = 0; k < 3; k++) {
		input.motion[k].rate[2] = (int16_t)lround(input.row.rate[k] * COUNTS_PER_GYRO_COUNT);
		input.motion[k].force[2] = COUNTS_PER_G;
	}
	input.field[0] = (int16_t)lround(NORTH_COUNTS * cos(bearing));
	input.field[1] = (int16_t)lround(NORTH_COUNTS * sin(bearing));
	input.field[2] = -2 * NORTH_COUNTS;
}

/* Runs one millisecond per row; they are plain or extended ones. */
static void advance(const char *rows, uint32_t length, size_t size)
{
	if (length % size)
		fail("a record of rows has %u bytes, not a multiple of %zu", length, size);
	for (const char *next = rows; next < rows + length; next += size) {
		previous = input;
		memcpy(&input, next, size);
		if (size == sizeof input.row)
			extend_row();
		swap_sensors();
		run_millisecond(clock_next_millisecond());
		pty_poll();
	}
	put_record('A', "", 0);
	flush();
}

void bench_run(void)
{
	static char body[MAX_RECORD + 1];
	struct {
		uint8_t kind;
		uint32_t length;
	} __attribute__((packed)) head;

	while (read_all(&head, sizeof head)) {
		if (head.length > MAX_RECORD)
			fail("a record of %u bytes is too long", head.length);
		if (!read_all(body, head.length))
			fail("the input ends in the middle of a record");
		body[head.length] = 0;
		switch (head.kind) {
		case 'R': advance(body, head.length, sizeof input.row); break;
		case 'E': advance(body, head.length, sizeof input); break;
		case 'H': usb_host_send((uint8_t *)body, head.length); break;
		case 'F': switch_fault(body); break;
		case 'Q': flush(); return;
		default: fail("unknown record 0x%02x", head.kind);
		}
	}
	fail("the input ends without a record Q");
}

/* simavr prints on stdout: its text must not get into the protocol. */
void bench_init(void)
{
	out = fdopen(dup(STDOUT_FILENO), "wb");
	if (!out || setvbuf(out, NULL, _IOFBF, 1 << 16) || !freopen("/dev/null", "w", stdout))
		fail("cannot set up the output");
}
