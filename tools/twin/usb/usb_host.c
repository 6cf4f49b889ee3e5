/* SPDX-License-Identifier: GPL-3.0-or-later
 * The USB host: waits for a device, resets and enumerates it, configures the CDC-ACM port, then moves bulk data every
 * millisecond. The requests are those of a Linux host with its cdc_acm driver, or those of Windows or macOS. */
#include <string.h>

#include <simavr/sim_cycle_timers.h>

#include "twin.h"

#define CONTROL_POLL US(100)
#define FRAME US(1000)
#define DEBOUNCE_MS 20
#define IDLE_MS 3    /* without traffic, then a device is suspended */
#define RESUME_MS 30 /* resume signal and recovery */
#define RECOVERY_MS 10       /* before each request of an enumeration */
#define STAGE_LIMIT_MS 500   /* for each stage of a request */
#define DTR_RTS 3
#define TWIGGLE_MS 50
#define PACKET 64

/* The begin of requests [USB 2.0, 9.4; CDC 1.2], and types of descriptors. */
enum { TO_DEVICE = 0x00, TO_INTERFACE = 0x01, CLASS = 0x21, FROM_DEVICE = 0x80 };
enum { SET_ADDRESS = 5, GET_DESCRIPTOR, SET_CONFIGURATION = 9, SET_INTERFACE = 11 };
enum { SET_LINE_CODING = 0x20, SET_CONTROL_LINE_STATE = 0x22 };
enum { DEVICE = 1, CONFIGURATION, STRING, ENDPOINT = 5 };

enum stage { SETUP, DATA_IN, DATA_OUT, STATUS_IN, STATUS_OUT };

FAULT_SWITCH(host, "read stall", NULL, 0)

static enum { DETACHED, DEBOUNCING, ENUMERATING, RUNNING, SUSPENDED, RESUMING } state;
static unsigned step;
static enum stage stage;
static uint8_t request[16]; /* under way */
static bool requesting;
static unsigned received, stage_ms, waited_ms;
static uint8_t in_endpoint, out_endpoint;
static bool wanted_open, is_open;
static enum { NOT_CLOSING, CLOSE_RATE, CLOSE_PORT, CLOSED } closing;
static bool closing_twiggles;
static unsigned closed_ms;
static uint16_t frame_number;
static uint8_t outbox[1 << 16];
static unsigned outbox_length;
static uint8_t descriptor[256];
static int control_size;

/* Finds the bulk endpoints in the configuration descriptor, as a driver does. */
static void find_endpoints(void)
{
	for (unsigned start = 0; start + 3 < received && descriptor[start]; start += descriptor[start]) {
		const uint8_t *d = descriptor + start;

		if (d[1] != ENDPOINT || (d[3] & 3) != 2)
			continue;
		if (d[2] & 0x80)
			in_endpoint = d[2] & 0x7F;
		else
			out_endpoint = d[2];
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
	const uint8_t bytes[16] = { CLASS, SET_CONTROL_LINE_STATE, open ? DTR_RTS : 0 };

	is_open = open;
	bench_trace(open ? "port opened" : "port closed");
	begin_request(bytes);
}

/* What a host shows of a device: its class, by which Windows chooses a driver, and its serial number. */
static void take_descriptor(void)
{
	char text[PACKET] = "";
	const uint8_t *d = descriptor;

	if (request[3] == DEVICE && received >= 8)
		control_size = d[7];
	if (request[3] == DEVICE && received >= 18) {
		bench_trace("usb release %x.%02x", d[13], d[12]);
		bench_trace("usb class %02x subclass %02x serial string %u", d[4], d[5], d[16]);
	}
	if (request[3] == CONFIGURATION)
		find_endpoints();
	if (request[3] == CONFIGURATION && received >= 18)
		bench_trace("usb first interface: class %02x protocol %02x", d[14], d[16]);
	if (request[3] != STRING || (request[2] != 3 && request[2] != 4))
		return;
	for (unsigned k = 2; k + 1 < received && k / 2 < sizeof text; k += 2)
		text[k / 2 - 1] = (char)d[k];
	bench_trace("usb %s %s", request[2] == 3 ? "serial number" : "interface", text);
}

/* Requests that change the address or the data toggles take effect on both ends. */
static void finish_request(void)
{
	requesting = false;
	if (request[0] == TO_DEVICE && request[1] == SET_ADDRESS)
		usb_target(request[2]);
	if ((request[0] == TO_DEVICE && request[1] == SET_CONFIGURATION) ||
	    (request[0] == TO_INTERFACE && request[1] == SET_INTERFACE))
		usb_reset_toggles();
	if (request[0] == FROM_DEVICE && request[1] == GET_DESCRIPTOR)
		take_descriptor();
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

static void take_data(const uint8_t *bytes, int count, unsigned length)
{
	for (int k = 0; k < count && received < length; k++)
		descriptor[received++] = bytes[k];
	if (count < control_size || received >= length)
		next_stage(STATUS_OUT);
}

/* Tries the stage under way once: the request goes on to its next stage, or ends; a stall ends it, too. */
static void advance_request(void)
{
	uint8_t bytes[PACKET];
	unsigned length = request[6] | (unsigned)request[7] << 8;
	int answer = USB_SILENCE;

	switch (stage) {
	case SETUP:
		if (usb_setup(request) == USB_ACK)
			next_stage(!length ? STATUS_IN : request[0] & FROM_DEVICE ? DATA_IN : DATA_OUT);
		return;
	case DATA_IN:
	case STATUS_IN: answer = usb_in(0, bytes); break;
	case DATA_OUT: answer = usb_out(0, request + 8, length); break;
	case STATUS_OUT: answer = usb_out(0, NULL, 0) == USB_ACK ? USB_ACK : USB_NAK; break;
	}
	if (answer < 0 && answer != USB_STALL)
		return;
	if (answer == USB_STALL || stage == STATUS_IN || stage == STATUS_OUT)
		finish_request();
	else if (stage == DATA_IN)
		take_data(bytes, answer, length);
	else
		next_stage(STATUS_IN);
}

static void close_at_1200_baud(void)
{
	static const uint8_t rate[16] = { CLASS, SET_LINE_CODING, 0, 0, 0, 0, 7, 0, 0xB0, 0x04, 0, 0, 0, 0, 8 };

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
	uint8_t bytes[PACKET];

	while (outbox_length) {
		unsigned part = outbox_length < PACKET ? outbox_length : PACKET;

		if (usb_out(out_endpoint, outbox, part) != USB_ACK)
			break;
		outbox_length -= part;
		memmove(outbox, outbox + part, outbox_length);
	}
	if (!is_open || host.value)
		return;
	for (unsigned k = usb_hub_frame(); k && pty_has_room(); k--) {
		int length = usb_in(in_endpoint, bytes);

		if (length >= 0)
			usb_hub_take(bytes, (unsigned)length);
		else if (length != USB_REPEATED && length != USB_SILENCE)
			break;
	}
}

static void wait_as(unsigned next)
{
	state = next;
	waited_ms = 0;
}

/* No request is under way any more, and the port is closed. */
static void go(unsigned next)
{
	wait_as(next);
	requesting = is_open = false;
}

static void reset_bus(void)
{
	usb_bus_event(USB_RESET, 0);
	usb_target(0);
	usb_reset_toggles();
	waited_ms = 0;
}

static void next_step(void)
{
	if (usb_system_step(step)[0] == USB_STEP_BUS_RESET) {
		reset_bus();
		step++;
	} else {
		begin_request(usb_system_step(step));
	}
}

void usb_host_reset(void)
{
	reset_bus();
	go(ENUMERATING);
	step = 0;
	control_size = usb_system_step(0)[6]; /* before the device has named it: Windows reads 64 bytes at once */
}

/* Once a millisecond: follows attach and detach, and gives up requests without an answer. */
static void watch(void)
{
	if (!usb_device_attached()) {
		go(DETACHED);
	} else if (state == DETACHED) {
		go(DEBOUNCING);
	} else if (state == DEBOUNCING && ++waited_ms >= DEBOUNCE_MS + usb_hub_debounce_ms()) {
		usb_host_reset();
	}
	if (waited_ms == IDLE_MS && (state == DEBOUNCING || state == SUSPENDED))
		usb_bus_event(USB_SUSPEND, 0);
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

static void run_frame(void)
{
	watch();
	if (state == ENUMERATING || state == RUNNING)
		usb_bus_event(USB_FRAME, frame_number++);
	if (requesting)
		return;
	if (state == ENUMERATING && ++waited_ms > RECOVERY_MS)
		next_step();
	if (state != RUNNING)
		return;
	if (closing)
		close_at_1200_baud();
	else if (wanted_open != is_open)
		set_line_state(wanted_open);
	else
		move_bulk();
}

static avr_cycle_count_t poll(avr_t *a, avr_cycle_count_t when, void *param)
{
	if (avr->cycle % FRAME < CONTROL_POLL || !requesting)
		run_frame();
	if (!requesting)
		return when - when % FRAME + FRAME;
	advance_request();
	return when + CONTROL_POLL;
}

void usb_host_unplug(void)
{
	usb_hub_clear();
	go(DETACHED);
	outbox_length = 0;
}

void usb_host_start(void)
{
	usb_host_unplug();
	avr_cycle_timer_register(avr, FRAME - avr->cycle % FRAME, poll, NULL);
}

enum { UNPLUG, PLUG, RESET, CONFIGURE, INTERFACE, TOUCH, TWIGGLE, SUSPEND, RESUME };

static void act(void *self, unsigned before)
{
	static const uint8_t configuration_1[16] = { TO_DEVICE, SET_CONFIGURATION, 1 };
	static const uint8_t data_interface[16] = { TO_INTERFACE, SET_INTERFACE, 0, 0, 1 };
	unsigned action = ((struct fault_switch *)self)->value;
	bool idle = state == RUNNING && !requesting;

	switch (action) {
	case UNPLUG:
	case PLUG: board_power(action == PLUG); break;
	case RESET: /* of the bus: the device is enumerated again */
		usb_hub_clear();
		go(state == DETACHED ? DETACHED : DEBOUNCING);
		break;
	case CONFIGURE:
	/* some hosts choose the setting of an interface that has only one; it too resets the data toggles [USB 2.0,
	 * 9.1.1.5] */
	case INTERFACE:
		if (idle)
			begin_request(action == INTERFACE ? data_interface : configuration_1);
		break;
	case TOUCH: /* a program sets 1200 Bd and closes the port */
	case TWIGGLE: /* the same, but DTR returns after 50 ms, as it does when some hosts change the rate */
		closing = CLOSE_RATE;
		closing_twiggles = action == TWIGGLE;
		break;
	case SUSPEND:
		if (idle)
			wait_as(SUSPENDED);
		break;
	default:
		if (state == SUSPENDED) {
			usb_bus_event(USB_RESUME, 0);
			wait_as(RESUMING);
		}
	}
}
FAULT_SWITCH(usb, "unplug plug reset configure interface touch twiggle suspend resume", act, PLUG)

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
