/* SPDX-License-Identifier: MIT */
#include "link.h"
#include "board.h"  /* usb_* */
#include "status.h" /* drop counters */

/* `configure` is the longest frame from a host; a longer one is bad. */
#define RECEIVE_MAX COBS_ENCODED_MAX(FRAME_OVERHEAD + (unsigned)MSG_CONFIGURE_SIZE)

#define BYTES_PER_CALL 64u /* limit, so that a flood of bytes from the host does not delay the sensors */

static uint8_t payload[FRAME_PAYLOAD_MAX];
static uint16_t sequence;
static uint8_t received[RECEIVE_MAX];
static uint8_t subscribed; /* REPORTS_* */
static uint8_t received_length; /* RECEIVE_MAX + 1: the frame is too long, its rest is skipped */

uint8_t *link_body(void)
{
	return payload + FRAME_HEAD_SIZE;
}

/* Drop counter of a message. */
static uint16_t *dropped(uint8_t id)
{
	switch (id) {
	case MSG_PING:
		return &status.dropped_ping;
	case MSG_GYROS:
	case MSG_MOTION:
	case MSG_FOOT:
		return &status.dropped_gyros;
	case MSG_PRESSURE:
		return &status.dropped_pressure;
	case MSG_COMPASS:
	case MSG_MAGNETIC:
		return &status.dropped_compass;
	case MSG_SYNC:
		return &status.dropped_sync;
	default:
		return &status.dropped_other;
	}
}

void link_send(uint8_t id, uint8_t body_length)
{
	uint8_t encoded[FRAME_ENCODED_MAX];
	if (!usb_is_open())
		return;
	uint8_t length = frame_encode(encoded, payload, id, sequence++, body_length);
	if (!usb_write(encoded, length))
		++*dropped(id);
}

void link_open(void)
{
	static const uint8_t zero = 0;
	received_length = 0;
	subscribed = 0;
	(void)usb_write(&zero, 1); /* the buffer was just emptied: there is room */
}

void link_subscribe(uint8_t reports)
{
	subscribed = reports;
}

bool link_wants(uint8_t reports)
{
	return (subscribed & reports) != 0;
}

/* Decodes the bytes received before a zero; true: `out` holds a command. */
static bool close_frame(struct link_command *out)
{
	uint8_t length = received_length;
	received_length = 0;
	if (length == 0)
		return false;
	int16_t body_length = length > RECEIVE_MAX ? (int16_t)-1 : frame_decode(received, length);
	if (body_length < 0) {
		status.bad_frames++;
		return false;
	}
	*out = (struct link_command){ received[0], (uint8_t)body_length, received + FRAME_HEAD_SIZE };
	return true;
}

bool link_receive(struct link_command *out)
{
	for (uint8_t n = 0; n < BYTES_PER_CALL; n++) {
		int16_t byte = usb_read();
		if (byte < 0)
			return false;
		if (byte == 0 && close_frame(out))
			return true;
		if (byte == 0 || received_length > RECEIVE_MAX)
			continue;
		if (received_length < RECEIVE_MAX)
			received[received_length] = (uint8_t)byte;
		received_length++;
	}
	return false;
}
