/* SPDX-License-Identifier: MIT */
/* USB control endpoint: standard requests [USB 2.0, chapter 9] and those of the CDC-ACM class [PSTN120, 6.3]. Never
 * waits: each call of usb_control_run does what the controller is ready for, and enables the interrupt of the next
 * step. */
#include <avr/io.h> /* registers */
#include "shared.h"
#include "usb.h"

#define MEMORY_64 (BIT(EPSIZE1) | BIT(EPSIZE0) | BIT(ALLOC))
#define BOOTLOADER_BAUD 1200u
#define LINE_CODING_SIZE 7u
#define DATA_INTERFACE 1u
#define DTR_LOW_TICKS (120u * TICKS_PER_MS) /* most hosts let DTR fall for a moment [Arduino, cores/arduino/CDC.cpp] */

enum { /* bRequest */
	GET_STATUS = 0,
	CLEAR_FEATURE = 1,
	SET_FEATURE = 3,
	SET_ADDRESS = 5,
	GET_DESCRIPTOR = 6,
	GET_CONFIGURATION = 8,
	SET_CONFIGURATION = 9,
	GET_INTERFACE = 10,
	SET_INTERFACE = 11,
	SET_LINE_CODING = 0x20,
	GET_LINE_CODING = 0x21,
	SET_CONTROL_LINE_STATE = 0x22,
};

enum { /* bmRequestType: direction, type, recipient */
	TO_DEVICE = 0x00,
	TO_INTERFACE = 0x01,
	TO_ENDPOINT = 0x02,
	TO_PORT = 0x21,
	FROM_DEVICE = 0x80,
	FROM_INTERFACE = 0x81,
	FROM_ENDPOINT = 0x82,
	FROM_PORT = 0xA1,
};
#define REQUEST(type, request) ((uint16_t)((uint16_t)(type) << 8 | (uint16_t)(request)))

struct setup {
	uint8_t type, request;
	uint16_t value, index, length;
};

/* Of the request under way. REPLYING and DESCRIBING: data for the host. ACKNOWLEDGING: the empty packet of the status
 * stage. ADDRESSING: after it, the new address takes effect. */
enum stage { IDLE, REPLYING, DESCRIBING, RECEIVING_LINE_CODING, ACKNOWLEDGING, ADDRESSING };

static enum stage stage;
static uint8_t configured; /* bConfigurationValue */
static bool addressing; /* the request under way sets the address */
static bool dtr;
static uint8_t line_coding[LINE_CODING_SIZE] = { 0x00, 0xC2, 0x01, 0x00, 0, 0, 8 }; /* 115200 8N1; has no effect */
static bool opened;       /* since the last call of usb_take_opening */
static bool reconfigured; /* since the host last set the line state */
static bool bootloader_wanted; /* at this time: */
static uint32_t bootloader_due;
static struct {
	const uint8_t *bytes; /* when REPLYING */
	uint16_t descriptor;  /* when DESCRIBING: wValue of the request */
	uint8_t index, length;
} reply;
static uint8_t answer[2];

void usb_control_start(void)
{
	stage = IDLE;
	configured = 0;
	dtr = addressing = false;
	usb_enable(EP_CONTROL, 0, MEMORY_64);
}

bool usb_control_is_configured(void)
{
	return configured != 0;
}

bool usb_control_port_is_open(void)
{
	return dtr;
}

bool usb_take_opening(void)
{
	bool was = opened;
	opened = false;
	return was;
}

bool usb_bootloader_wanted(void)
{
	/* only after the host has its acknowledge */
	return bootloader_wanted && ticks_reached(clock_now(), bootloader_due) && stage == IDLE;
}

static bool send(enum stage how, uint8_t length, uint16_t wanted)
{
	reply.index = 0;
	reply.length = (uint8_t)(wanted < length ? wanted : length);
	stage = how;
	return true;
}

static bool send_bytes(const uint8_t *bytes, uint8_t length, uint16_t wanted)
{
	reply.bytes = bytes;
	return send(REPLYING, length, wanted);
}

static bool send_answer(uint8_t low, uint8_t length, uint16_t wanted)
{
	answer[0] = low;
	answer[1] = 0;
	return send_bytes(answer, length, wanted);
}

static bool acknowledge(void)
{
	stage = ACKNOWLEDGING;
	return true;
}

static bool send_descriptor(const struct setup *s)
{
	uint8_t length = usb_descriptor_length(s->value);
	reply.descriptor = s->value;
	// cppcheck-suppress knownConditionTrueFalse ; every kind of reply returns whether there is one
	return length && send(DESCRIBING, length, s->length);
}

/* A host may set the same configuration again: the endpoints start anew, and an open port stays open. */
static bool set_configuration(uint8_t value)
{
	if (value > 1)
		return false;
	configured = value;
	reconfigured = true;
	dtr = dtr && configured;
	if (configured)
		usb_start_port();
	return acknowledge();
}

/* The only setting of an interface resets the data toggles of its endpoints [USB 2.0, 9.1.1.5]. */
static bool set_interface(const struct setup *s)
{
	if (s->value != 0)
		return false;
	if (configured && s->index == DATA_INTERFACE)
		usb_start_port();
	return acknowledge();
}

/* The address and its bit ADDEN must not be written at once [data sheet, 22.7]; ADDEN follows after the status
 * stage. */
static bool set_address(uint8_t address)
{
	UDADDR = address;
	addressing = true;
	return acknowledge();
}

static void check_for_1200_baud(void)
{
	bool slow = line_coding[0] == (BOOTLOADER_BAUD & 0xFFu) && line_coding[1] == BOOTLOADER_BAUD >> 8;
	bool wanted = slow && !line_coding[2] && !dtr;
	if (wanted && !bootloader_wanted)
		bootloader_due = clock_now() + DTR_LOW_TICKS;
	bootloader_wanted = wanted;
}

static bool set_line_state(bool new_dtr)
{
	if (new_dtr && (!dtr || reconfigured)) {
		usb_empty_port();
		opened = true;
	}
	dtr = new_dtr;
	reconfigured = false;
	check_for_1200_baud();
	return acknowledge();
}

/* Selects the endpoint of a halt request, which may not be the control endpoint; false: there is no such endpoint. */
static bool select_endpoint(const struct setup *s)
{
	uint8_t endpoint = s->index & 0x7Fu;
	if (!configured || endpoint == EP_CONTROL || endpoint >= EP_COUNT)
		return false;
	UENUM = endpoint;
	return true;
}

static bool set_halt(const struct setup *s, bool halt)
{
	if (s->value != 0 || !select_endpoint(s))
		return false;
	UECONX = halt ? BIT(STALLRQ) | BIT(EPEN) : BIT(STALLRQC) | BIT(RSTDT) | BIT(EPEN);
	return acknowledge();
}

static bool send_halt(const struct setup *s)
{
	bool halted = select_endpoint(s) && (UECONX & BIT(STALLRQ));
	return send_answer(halted, 2, s->length);
}

/* Answers a request; false: not supported, the endpoint stalls. */
static bool handle_request(const struct setup *s)
{
	switch (REQUEST(s->type, s->request)) {
	case REQUEST(FROM_DEVICE, GET_DESCRIPTOR):
		return send_descriptor(s);
	case REQUEST(TO_DEVICE, SET_ADDRESS):
		return set_address(s->value & 0x7Fu);
	case REQUEST(TO_DEVICE, SET_CONFIGURATION):
		return set_configuration((uint8_t)s->value);
	case REQUEST(FROM_DEVICE, GET_CONFIGURATION):
		return send_answer(configured, 1, s->length);
	case REQUEST(FROM_DEVICE, GET_STATUS):
	case REQUEST(FROM_INTERFACE, GET_STATUS):
		return send_answer(0, 2, s->length);
	case REQUEST(FROM_ENDPOINT, GET_STATUS):
		return send_halt(s);
	case REQUEST(TO_ENDPOINT, SET_FEATURE):
		return set_halt(s, true);
	case REQUEST(TO_ENDPOINT, CLEAR_FEATURE):
		return set_halt(s, false);
	case REQUEST(FROM_INTERFACE, GET_INTERFACE):
		return send_answer(0, 1, s->length);
	case REQUEST(TO_INTERFACE, SET_INTERFACE):
		return set_interface(s);
	case REQUEST(FROM_PORT, GET_LINE_CODING):
		return send_bytes(line_coding, LINE_CODING_SIZE, s->length);
	case REQUEST(TO_PORT, SET_LINE_CODING):
		stage = RECEIVING_LINE_CODING;
		return s->length == LINE_CODING_SIZE;
	case REQUEST(TO_PORT, SET_CONTROL_LINE_STATE):
		return set_line_state(s->value & 1u);
	default:
		return false;
	}
}

static uint16_t read16(void)
{
	uint8_t low = UEDATX;
	return (uint16_t)(low | (uint16_t)UEDATX << 8);
}

static void receive_setup(void)
{
	struct setup s;
	s.type = UEDATX;
	s.request = UEDATX;
	s.value = read16();
	s.index = read16();
	s.length = read16();
	UEINTX = (uint8_t)~(BIT(RXSTPI) | BIT(RXOUTI));
	stage = IDLE;
	addressing = false;
	if (handle_request(&s))
		return;
	stage = IDLE;
	UENUM = EP_CONTROL;
	UECONX = BIT(STALLRQ) | BIT(EPEN);
}

/* Receives either a line coding, or the empty packet with which the host ends or aborts a read. */
static void receive_packet(void)
{
	if (stage == RECEIVING_LINE_CODING) {
		for (uint8_t n = 0; n < LINE_CODING_SIZE; n++)
			line_coding[n] = UEDATX;
		check_for_1200_baud();
		stage = ACKNOWLEDGING;
	} else {
		stage = IDLE;
	}
	UEINTX = (uint8_t)~BIT(RXOUTI);
}

static void send_part(void)
{
	for (uint8_t n = 0; n < EP_SIZE && reply.index < reply.length; n++, reply.index++)
		UEDATX = stage == DESCRIBING ? usb_descriptor_byte(reply.descriptor, reply.index) : reply.bytes[reply.index];
	/* no descriptor's length is a multiple of EP_SIZE: the last packet is short, or has the last byte wanted */
	if (reply.index == reply.length)
		stage = IDLE;
	UEINTX = (uint8_t)~BIT(TXINI);
}

/* Sends the next packet; the bank for answers is free. A new address takes effect after the transfer that set it. */
static void send_next(void)
{
	switch (stage) {
	case REPLYING:
	case DESCRIBING:
		send_part();
		break;
	case ACKNOWLEDGING:
		stage = addressing ? ADDRESSING : IDLE;
		addressing = false;
		UEINTX = (uint8_t)~BIT(TXINI);
		break;
	case ADDRESSING:
		UDADDR |= BIT(ADDEN);
		stage = IDLE;
		break;
	default:
		break;
	}
}

void usb_control_run(void)
{
	UENUM = EP_CONTROL;
	if (UEINTX & BIT(RXSTPI))
		receive_setup();
	UENUM = EP_CONTROL;
	if (UEINTX & BIT(RXOUTI))
		receive_packet();
	if (UEINTX & BIT(TXINI))
		send_next();
	bool sending = stage == REPLYING || stage == DESCRIBING || stage == ACKNOWLEDGING || stage == ADDRESSING;
	UEIENX = (uint8_t)(BIT(RXSTPE) | BIT(RXOUTE) | (sending ? BIT(TXINE) : 0u));
}
