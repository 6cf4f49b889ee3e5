/* SPDX-License-Identifier: GPL-3.0-or-later
 * The USB cable: transactions between host and device, with the data toggles of both ends [USB 2.0, 8.6], and packets that are damaged on the
 * way. A damaged packet is as if it had not been sent: its checksum is wrong. */
#include <stdlib.h>
#include <string.h>

#include "twin.h"

#define ENDPOINTS 7

static unsigned errors; /* damaged packets in 1000 */
static bool in_toggle[ENDPOINTS], out_toggle[ENDPOINTS]; /* that the host expects and sends next */

static bool damaged(void)
{
	return errors && random_below(1000) < errors;
}

void usb_cable_reset_toggles(void)
{
	memset(in_toggle, 0, sizeof in_toggle);
	memset(out_toggle, 0, sizeof out_toggle);
}

int usb_cable_setup(const uint8_t *request)
{
	if (damaged() || usb_setup(request) != USB_ACK || damaged())
		return USB_SILENCE;
	in_toggle[0] = out_toggle[0] = true;
	return USB_ACK;
}

/* A packet with the toggle of the previous one is a repetition: it is acknowledged and dropped. */
int usb_cable_in(uint8_t endpoint, uint8_t *bytes)
{
	bool toggle;
	int length = damaged() ? USB_SILENCE : usb_in(endpoint, bytes, &toggle);

	if (length < 0 || damaged())
		return length < 0 ? length : USB_SILENCE;
	if (!damaged()) /* the acknowledge */
		usb_in_acknowledged(endpoint);
	if (toggle != in_toggle[endpoint]) {
		bench_trace("usb: a packet of %d bytes came again", length);
		return USB_REPEATED;
	}
	in_toggle[endpoint] = !toggle;
	return length;
}

int usb_cable_out(uint8_t endpoint, const uint8_t *bytes, unsigned length)
{
	int answer = damaged() ? USB_SILENCE : usb_out(endpoint, bytes, length, out_toggle[endpoint]);

	if (answer != USB_ACK)
		return answer;
	if (damaged())
		return USB_SILENCE;
	out_toggle[endpoint] = !out_toggle[endpoint];
	return USB_ACK;
}

bool usb_cable_errors(const char *value)
{
	char *end;
	unsigned long wanted = strtoul(value, &end, 10);

	if (end == value || *end || wanted > 500)
		return false;
	errors = (unsigned)wanted;
	return true;
}
