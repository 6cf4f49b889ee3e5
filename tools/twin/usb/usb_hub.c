/* SPDX-License-Identifier: GPL-3.0-or-later
 * A high-speed hub between host and board [USB 2.0, chapter 11]: its transaction translator hands on in one frame what
 * it has received in the frame before, its bandwidth is shared with other devices, and the port is debounced for 100 ms
 * [7.1.7.3]. */
#include <string.h>

#include "twin.h"

#define PACKETS_ALONE 19 /* maximum of full speed in a frame */
#define PACKETS_SHARED 4 /* assumed: others behind the hub use the rest */
#define DEBOUNCE_MS 100
#define PACKET 64

static void changed(void *self, unsigned before)
{
	usb_hub_clear();
}
FAULT_SWITCH(host_hub, "off on", changed, 0)

static uint8_t held[PACKETS_SHARED * PACKET]; /* on the way to the host */
static unsigned held_length;

unsigned usb_hub_debounce_ms(void)
{
	return host_hub.value ? DEBOUNCE_MS : 0;
}

/* Begins a frame: how many packets it has room for. */
unsigned usb_hub_frame(void)
{
	if (!host_hub.value)
		return PACKETS_ALONE;
	if (!pty_has_room())
		return 0;
	if (held_length)
		bench_sent(held, held_length);
	held_length = 0;
	return PACKETS_SHARED;
}

void usb_hub_take(const uint8_t *bytes, unsigned length)
{
	if (!host_hub.value) {
		bench_sent(bytes, length);
		return;
	}
	memcpy(held + held_length, bytes, length);
	held_length += length;
}

void usb_hub_clear(void)
{
	held_length = 0;
}
