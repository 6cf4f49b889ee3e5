/* SPDX-License-Identifier: GPL-3.0-or-later
 * USB device controller of the ATmega32U4: its endpoints as the cable sees them [data sheet, chapter 22]. */
#include <string.h>

#include "twin.h"
#include "usb/usb_endpoints.h"

static bool control_out_toggle;
static uint8_t target; /* address of the transactions on the cable */

void usb_target(uint8_t address)
{
	target = address;
}

/* The endpoint with this number; NULL: not enabled, or the device has another address. */
static struct endpoint *enabled_endpoint(uint8_t number)
{
	uint8_t own = avr->data[UDADDR] & ADDEN ? avr->data[UDADDR] & 0x7F : 0;

	if (own != target)
		return NULL;
	if (!usb_device_attached() || number >= ENDPOINTS || !(usb_endpoints[number].conx & EPEN) || !(usb_endpoints[number].cfg1 & ALLOC))
		return NULL;
	return &usb_endpoints[number];
}

int usb_setup(const uint8_t *request)
{
	struct endpoint *e = enabled_endpoint(0);

	if (!e)
		return USB_SILENCE;
	e->stalled = false; /* a SETUP is always accepted */
	e->toggle = control_out_toggle = true;
	memcpy(e->bank[0].bytes, request, 8);
	e->bank[0].length = 8;
	e->bank[0].read = 0;
	e->flags = (uint8_t)((e->flags & ~RXOUTI) | RXSTPI);
	usb_refresh();
	return USB_ACK;
}

static struct bank *bank_for_host(struct endpoint *e)
{
	return &e->bank[is_control(e) ? 1 : e->cable];
}

int usb_in(uint8_t endpoint, uint8_t *bytes, bool *toggle)
{
	struct endpoint *e = enabled_endpoint(endpoint);

	if (!e)
		return USB_SILENCE;

	const struct bank *b = bank_for_host(e);

	if (e->stalled) {
		e->flags |= STALLEDI;
		usb_refresh();
		return USB_STALL;
	}
	if ((is_control(e) && (e->flags & RXSTPI)) || !b->full) {
		e->flags |= NAKINI;
		usb_refresh();
		return USB_NAK;
	}
	memcpy(bytes, b->bytes, (size_t)b->length);
	*toggle = e->toggle;
	return b->length;
}

/* The host has the packet: its bank is free. */
void usb_in_acknowledged(uint8_t endpoint)
{
	struct endpoint *e = &usb_endpoints[endpoint];
	struct bank *b = bank_for_host(e);

	b->length = b->read = 0;
	b->full = false;
	e->toggle = !e->toggle;
	if (is_control(e)) {
		e->flags |= TXINI;
	} else {
		e->cable = (e->cable + 1) % banks_of(e);
		usb_offer_bank(e);
	}
	usb_refresh();
}

int usb_out(uint8_t endpoint, const uint8_t *bytes, unsigned length, bool toggle)
{
	struct endpoint *e = enabled_endpoint(endpoint);

	if (!e || length > (unsigned)size_of(e))
		return USB_SILENCE;

	struct bank *b = &e->bank[is_control(e) ? 0 : e->cable];

	if (e->stalled) {
		e->flags |= STALLEDI;
		usb_refresh();
		return USB_STALL;
	}
	if ((is_control(e) && (e->flags & (RXSTPI | RXOUTI))) || b->full) {
		e->flags |= NAKOUTI;
		usb_refresh();
		return USB_NAK;
	}
	bool *expected = is_control(e) ? &control_out_toggle : &e->toggle;

	if (toggle != *expected) {
		bench_trace("usb: the device drops a repeated packet of %u bytes", length);
		return USB_ACK;
	}
	*expected = !toggle;
	if (length)
		memcpy(b->bytes, bytes, length);
	b->length = (int)length;
	b->read = 0;
	if (is_control(e)) {
		e->flags |= RXOUTI;
	} else {
		b->full = true;
		e->cable = (e->cable + 1) % banks_of(e);
		usb_offer_bank(e);
	}
	usb_refresh();
	return USB_ACK;
}
