#include "link.h"
#include "board.h"
#include "status.h"

/* The longest frame a host has reason to send is `configure`; anything longer is bad before its end is seen. */
#define RECEIVE_MAX COBS_ENCODED_MAX(FRAME_OVERHEAD + (unsigned)MSG_CONFIGURE_SIZE)

#define BYTES_PER_CALL 64u /* a host that floods the board must not hold up the sensors */

static uint8_t payload[FRAME_PAYLOAD_MAX];
static uint16_t sequence;
static uint8_t received[RECEIVE_MAX];
static uint8_t received_length; /* RECEIVE_MAX + 1: too long, wait for the zero */

uint8_t *link_body(void)
{
	return payload + FRAME_HEAD_SIZE;
}

static uint16_t *dropped(uint8_t id)
{
	switch (id) {
	case MSG_PING:
		return &status.dropped_ping;
	case MSG_GYROS:
		return &status.dropped_gyros;
	case MSG_PRESSURE:
		return &status.dropped_pressure;
	case MSG_COMPASS:
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
	if (!usb_open())
		return;
	uint8_t length = frame_encode(encoded, payload, id, sequence++, body_length);
	if (!usb_write(encoded, length))
		++*dropped(id);
}

void link_open(void)
{
	static const uint8_t zero = 0;
	received_length = 0;
	(void)usb_write(&zero, 1); /* the port was just emptied: there is room */
}

/* What the bytes before a zero amount to; true: `out` holds a command. */
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
