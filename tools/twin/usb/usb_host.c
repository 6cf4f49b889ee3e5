/* SPDX-License-Identifier: GPL-3.0-or-later
 * The USB host: waits for a device, resets and enumerates it, configures the CDC-ACM port, then moves bulk data every millisecond. The
 * requests are those of a Linux host with its cdc_acm driver, or those of Windows or macOS. */
#include <string.h>

#include <simavr/sim_cycle_timers.h>

#include "twin.h"

#define CONTROL_POLL US(100)
#define FRAME US(1000)
#define DEBOUNCE_MS 20
#define IDLE_MS 3    /* without traffic, then a device is suspended */
#define RESUME_MS 30 /* resume signal and recovery */
#define STAGE_LIMIT_MS 500   /* for each stage of a request */
#define DTR_RTS 3
#define TWIGGLE_MS 50

enum stage { SETUP, DATA_IN, DATA_OUT, STATUS_IN, STATUS_OUT };

static enum { DETACHED, DEBOUNCING, ENUMERATING, RUNNING, SUSPENDED, RESUMING } state;
static unsigned step;
static enum stage stage;
static uint8_t request[16]; /* under way */
static bool requesting;
static unsigned received, stage_ms, waited_ms;
static uint8_t in_endpoint, out_endpoint;
static bool stalled, wanted_open, is_open;
static enum { NOT_CLOSING, CLOSE_RATE, CLOSE_PORT, CLOSED } closing;
static bool closing_twiggles;
static unsigned closed_ms;
static uint16_t frame_number;
static uint8_t outbox[1 << 16];
static unsigned outbox_length;
static uint8_t descriptor[256];
static int control_size = 8;

/* Finds the bulk endpoints in the configuration descriptor, as a driver does. */
static void find_endpoints(unsigned length)
{
	for (unsigned start = 0; start + 1 < length && descriptor[start]; start += descriptor[start])
		if (descriptor[start + 1] == 5 && start + 3 < length && (descriptor[start + 3] & 3) == 2) {
			if (descriptor[start + 2] & 0x80)
				in_endpoint = descriptor[start + 2] & 0x7F;
			else
				out_endpoint = descriptor[start + 2];
		}
}

static void begin_request(const uint8_t *bytes)
{
	memcpy(request, bytes, sizeof request);
	requesting = true;
	stage = SETUP;
	received = 0;
	stage_ms = 0;
}

static void set_line_state(bool open)
{
	const uint8_t bytes[16] = { 0x21, 0x22, open ? DTR_RTS : 0 };

	is_open = open;
	bench_trace(open ? "port opened" : "port closed");
	begin_request(bytes);
}

/* What a host shows of a device: its class, by which Windows chooses a driver, and its serial number. */
static void trace_descriptor(void)
{
	char text[64] = "";

	if (request[3] == 1 && received >= 18)
		bench_trace("usb release %x.%02x", descriptor[13], descriptor[12]);
	if (request[3] == 2 && received >= 18)
		bench_trace("usb first interface: class %02x protocol %02x", descriptor[14], descriptor[16]);
	if (request[3] == 1 && received >= 18)
		bench_trace("usb class %02x subclass %02x serial string %u", descriptor[4], descriptor[5], descriptor[16]);
	if (request[3] != 3 || request[2] != 3)
		return;
	for (unsigned k = 2; k + 1 < received && k / 2 < sizeof text; k += 2)
		text[k / 2 - 1] = (char)descriptor[k];
	bench_trace("usb serial number %s", text);
}

/* Requests that change the address or the data toggles take effect on both ends. */
static void apply_request(void)
{
	if (request[0] == 0 && request[1] == 5)
		usb_target(request[2]);
	if ((request[0] == 0 && request[1] == 9) || (request[0] == 1 && request[1] == 11))
		usb_cable_reset_toggles();
}

static void finish_request(void)
{
	requesting = false;
	apply_request();
	if (request[0] == 0x80 && request[1] == 6)
		trace_descriptor();
	if (request[0] == 0x80 && request[1] == 6 && request[3] == 1 && received >= 8)
		control_size = descriptor[7];
	if (request[0] == 0x80 && request[1] == 6 && request[3] == 2)
		find_endpoints(received);
	if (state == ENUMERATING && usb_system_step(++step)[0] == USB_STEPS_END) {
		state = RUNNING;
		bench_trace("enumerated");
	}
}

static void next_stage(enum stage next)
{
	stage = next;
	stage_ms = 0;
}

/* Tries the stage under way once; true: the request went on to its next stage, or ended. */
static bool advance_request(void)
{
	uint8_t bytes[64];
	unsigned length = request[6] | (unsigned)request[7] << 8;
	int answer;

	switch (stage) {
	case SETUP:
		if (usb_cable_setup(request) != USB_ACK)
			return false;
		next_stage(!length ? STATUS_IN : request[0] & 0x80 ? DATA_IN : DATA_OUT);
		return true;
	case DATA_IN:
		answer = usb_cable_in(0, bytes);
		if (answer == USB_STALL) {
			finish_request();
			return true;
		}
		if (answer < 0)
			return false;
		for (int k = 0; k < answer && received < length; k++)
			descriptor[received++] = bytes[k];
		if (answer < control_size || received >= length)
			next_stage(STATUS_OUT);
		return true;
	case DATA_OUT:
		answer = usb_cable_out(0, request + 8, length);
		if (answer == USB_ACK)
			next_stage(STATUS_IN);
		else if (answer == USB_STALL)
			finish_request();
		return answer == USB_ACK || answer == USB_STALL;
	case STATUS_IN:
		answer = usb_cable_in(0, bytes);
		if (answer < 0 && answer != USB_STALL)
			return false;
		finish_request();
		return true;
	case STATUS_OUT:
		if (usb_cable_out(0, NULL, 0) != USB_ACK)
			return false;
		finish_request();
		return true;
	}
	return false;
}

static void close_at_1200_baud(void)
{
	static const uint8_t rate[16] = { 0x21, 0x20, 0, 0, 0, 0, 7, 0, 0xB0, 0x04, 0, 0, 0, 0, 8 };

	if (closing == CLOSE_RATE) {
		begin_request(rate);
		closing = CLOSE_PORT;
	} else if (closing == CLOSE_PORT) {
		set_line_state(false);
		closed_ms = 0;
		closing = CLOSED;
		wanted_open = closing_twiggles;
	} else if (!closing_twiggles || ++closed_ms >= TWIGGLE_MS) {
		closing = NOT_CLOSING;
	}
}

static void move_bulk(void)
{
	uint8_t bytes[64];

	while (outbox_length) {
		unsigned part = outbox_length < 64 ? outbox_length : 64;

		if (usb_cable_out(out_endpoint, outbox, part) != USB_ACK)
			break;
		outbox_length -= part;
		memmove(outbox, outbox + part, outbox_length);
	}
	if (!is_open || stalled)
		return;
	for (unsigned k = usb_hub_frame(); k && bench_has_room(); k--) {
		int length = usb_cable_in(in_endpoint, bytes);

		if (length == USB_REPEATED || length == USB_SILENCE)
			continue;
		if (length < 0)
			break;
		usb_hub_take(bytes, (unsigned)length);
	}
}

static void reset_bus(void)
{
	usb_bus_reset();
	usb_target(0);
	usb_cable_reset_toggles();
}

static void next_step(void)
{
	if (usb_system_step(step)[0] == USB_STEP_BUS_RESET) {
		reset_bus();
		waited_ms = 0;
		step++;
	} else {
		begin_request(usb_system_step(step));
	}
}

/* Once a millisecond: follows attach and detach, and gives up requests without an answer. */
static void watch(void)
{
	if (!usb_device_attached()) {
		state = DETACHED;
		requesting = is_open = false;
	} else if (state == DETACHED) {
		state = DEBOUNCING;
		waited_ms = 0;
	} else if (state == DEBOUNCING && ++waited_ms >= DEBOUNCE_MS + usb_hub_debounce_ms()) {
		reset_bus();
		state = ENUMERATING;
		step = 0;
		control_size = usb_system_first_size();
		requesting = is_open = false;
		waited_ms = 0;
	}
	if (waited_ms == IDLE_MS && (state == DEBOUNCING || state == SUSPENDED))
		usb_bus_suspend();
	if (state == SUSPENDED && waited_ms <= IDLE_MS)
		waited_ms++;
	if (state == RESUMING && ++waited_ms > RESUME_MS)
		state = RUNNING;
	if (requesting && ++stage_ms > STAGE_LIMIT_MS) {
		bench_trace("usb: no answer to request %02x %02x", request[0], request[1]);
		state = DEBOUNCING;
		requesting = false;
	}
}

static avr_cycle_count_t poll(avr_t *a, avr_cycle_count_t when, void *param)
{
	(void)a;
	(void)param;
	if (avr->cycle % FRAME < CONTROL_POLL || !requesting) {
		watch();
		if (state == ENUMERATING || state == RUNNING)
			usb_frame(frame_number++);
		if (state == RUNNING && !requesting) {
			if (closing)
				close_at_1200_baud();
			else if (wanted_open != is_open)
				set_line_state(wanted_open);
			else
				move_bulk();
		}
		if (state == ENUMERATING && !requesting && ++waited_ms > 10)
			next_step();
	}
	if (requesting) {
		advance_request();
		return when + CONTROL_POLL;
	}
	return when - when % FRAME + FRAME;
}

void usb_host_start(void)
{
	usb_hub_clear();
	state = DETACHED;
	requesting = is_open = false;
	outbox_length = 0;
	avr_cycle_timer_register(avr, FRAME - avr->cycle % FRAME, poll, NULL);
}

void usb_host_unplug(void)
{
	usb_hub_clear();
	state = DETACHED;
	requesting = is_open = false;
	outbox_length = 0;
}

void usb_host_reset(void)
{
	usb_hub_clear();
	if (state != DETACHED)
		state = DEBOUNCING;
	waited_ms = 0;
	requesting = is_open = false;
}

void usb_host_suspend(bool on)
{
	if (on && state == RUNNING && !requesting) {
		state = SUSPENDED;
		waited_ms = 0;
	} else if (!on && state == SUSPENDED) {
		usb_bus_resume();
		state = RESUMING;
		waited_ms = 0;
	}
}

void usb_host_configure(void)
{
	static const uint8_t again[16] = { 0x00, 9, 1, 0, 0, 0, 0, 0 };

	if (state == RUNNING && !requesting)
		begin_request(again);
}

/* Some hosts choose the setting of an interface that has only one; it too resets the data toggles [USB 2.0, 9.1.1.5]. */
void usb_host_interface(void)
{
	static const uint8_t data_interface[16] = { 0x01, 11, 0, 0, 1, 0, 0, 0 };

	if (state == RUNNING && !requesting)
		begin_request(data_interface);
}

/* A program sets 1200 Bd and closes the port; `twiggle`: DTR returns after 50 ms, as it does when some hosts change the rate. */
void usb_host_touch(bool twiggle)
{
	closing = CLOSE_RATE;
	closing_twiggles = twiggle;
}

void usb_host_stall(bool on)
{
	stalled = on;
}

void usb_host_open(bool on)
{
	wanted_open = on;
}

void usb_host_send(const uint8_t *bytes, unsigned length)
{
	if (length > sizeof outbox - outbox_length)
		length = (unsigned)sizeof outbox - outbox_length;
	memcpy(outbox + outbox_length, bytes, length);
	outbox_length += length;
}
