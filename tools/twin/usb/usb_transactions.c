/* SPDX-License-Identifier: GPL-3.0-or-later
 * The cable: transactions between the host and the endpoints [USB 2.0, chapter 8; ATmega32U4 data sheet, chapter 22],
 * with the data toggles of both ends, and packets that are damaged on the way. A damaged packet is as if it had not
 * been sent: its checksum is wrong. */
#include <string.h>

#include "usb/usb_endpoints.h"

FAULT_SWITCH(usb_errors, "<=500", NULL, 0) /* damaged packets in 1000 */

static bool control_out_toggle;
static uint8_t target; /* address of the transactions on the cable */
static bool in_toggle[ENDPOINTS], out_toggle[ENDPOINTS]; /* that the host expects and sends next */

static bool damaged(void)
{
	return usb_errors.value && random_below(1000) < usb_errors.value;
}

void usb_target(uint8_t address)
{
	target = address;
}

void usb_reset_toggles(void)
{
	memset(in_toggle, 0, sizeof in_toggle);
	memset(out_toggle, 0, sizeof out_toggle);
}

/* The endpoint with this number; NULL: not enabled, or the device has another address. */
static struct endpoint *enabled_endpoint(uint8_t number)
{
	uint8_t own = avr->data[UDADDR] & ADDEN ? avr->data[UDADDR] & 0x7F : 0;
	struct endpoint *e = &usb_endpoints[number];
	bool is_mine = own == target && usb_device_attached() && number < ENDPOINTS;

	return is_mine && (e->conx & EPEN) && (e->cfg1 & ALLOC) ? e : NULL;
}

/* An answer without data, and what the endpoint notes of it. */
static int reply(struct endpoint *e, uint8_t flag, int answer)
{
	e->flags |= flag;
	usb_refresh();
	return answer;
}

/* The cable goes on to the next bank, and the program may have this one. */
static void hand_over(struct endpoint *e)
{
	e->cable = (e->cable + 1) % banks_of(e);
	usb_offer_bank(e);
	usb_refresh();
}

static int take_setup(const uint8_t *request)
{
	struct endpoint *e = enabled_endpoint(0);

	if (!e)
		return USB_SILENCE;
	e->stalled = false; /* a SETUP is always accepted */
	e->toggle = control_out_toggle = true;
	memcpy(e->bank[0].bytes, request, 8);
	e->bank[0].length = 8;
	e->bank[0].read = 0;
	e->flags &= (uint8_t)~RXOUTI;
	return reply(e, RXSTPI, USB_ACK);
}

static struct bank *bank_for_host(struct endpoint *e)
{
	return &e->bank[is_control(e) ? 1 : e->cable];
}

/* Returns the length, or a usb_answer; the packet stays until acknowledged. */
static int give_packet(struct endpoint *e, uint8_t *bytes)
{
	if (!e)
		return USB_SILENCE;

	const struct bank *b = bank_for_host(e);

	if (e->stalled)
		return reply(e, STALLEDI, USB_STALL);
	if ((is_control(e) && (e->flags & RXSTPI)) || !b->full)
		return reply(e, NAKINI, USB_NAK);
	memcpy(bytes, b->bytes, (size_t)b->length);
	return b->length;
}

/* The host has the packet: its bank is free. */
static void acknowledge(struct endpoint *e)
{
	struct bank *b = bank_for_host(e);

	b->length = b->read = 0;
	b->full = false;
	e->toggle = !e->toggle;
	if (is_control(e))
		reply(e, TXINI, USB_ACK);
	else
		hand_over(e);
}

static int take_packet(struct endpoint *e, const uint8_t *bytes, unsigned length, bool toggle)
{
	if (!e || length > (unsigned)size_of(e))
		return USB_SILENCE;

	struct bank *b = &e->bank[is_control(e) ? 0 : e->cable];
	bool *expected = is_control(e) ? &control_out_toggle : &e->toggle;

	if (e->stalled)
		return reply(e, STALLEDI, USB_STALL);
	if ((is_control(e) && (e->flags & (RXSTPI | RXOUTI))) || b->full)
		return reply(e, NAKOUTI, USB_NAK);
	if (toggle != *expected) {
		bench_trace("usb: the device drops a repeated packet of %u bytes", length);
		return USB_ACK;
	}
	*expected = !toggle;
	if (length)
		memcpy(b->bytes, bytes, length);
	b->length = (int)length;
	b->read = 0;
	if (is_control(e))
		return reply(e, RXOUTI, USB_ACK);
	b->full = true;
	hand_over(e);
	return USB_ACK;
}

int usb_setup(const uint8_t *request)
{
	if (damaged() || take_setup(request) != USB_ACK || damaged())
		return USB_SILENCE;
	in_toggle[0] = out_toggle[0] = true;
	return USB_ACK;
}

/* A packet with the toggle of the previous one is a repetition: it is acknowledged and dropped. */
int usb_in(uint8_t endpoint, uint8_t *bytes)
{
	struct endpoint *e = enabled_endpoint(endpoint);
	int length = damaged() ? USB_SILENCE : give_packet(e, bytes);

	if (length < 0 || damaged())
		return length < 0 ? length : USB_SILENCE;

	bool toggle = e->toggle;

	if (!damaged()) /* the acknowledge */
		acknowledge(e);
	if (toggle != in_toggle[endpoint]) {
		bench_trace("usb: a packet of %d bytes came again", length);
		return USB_REPEATED;
	}
	in_toggle[endpoint] = !toggle;
	return length;
}

int usb_out(uint8_t endpoint, const uint8_t *bytes, unsigned length)
{
	int answer = damaged() ? USB_SILENCE : take_packet(enabled_endpoint(endpoint), bytes, length, out_toggle[endpoint]);

	if (answer != USB_ACK)
		return answer;
	if (damaged())
		return USB_SILENCE;
	out_toggle[endpoint] = !out_toggle[endpoint];
	return USB_ACK;
}
