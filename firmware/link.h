/* Frames to and from the host: messages in, USB bytes out, and back. Owns the sequence numbers, the drop counters and the
 * unfinished frame from the host. */
#ifndef ECHOSTEP_LINK_H
#define ECHOSTEP_LINK_H

#include <stdbool.h>
#include <stdint.h>
#include "frame.h"

/* A host frame with a correct checksum. */
struct link_command {
	uint8_t id;
	uint8_t length;
	const uint8_t *body; /* valid until the next call of link_receive */
};

/* Where the next message's body is packed: `link_send(MSG_PING, pack_ping(link_body(), &ping))`. */
uint8_t *link_body(void);

/* Sends the packed body. While no host holds the port nothing is sent; when the host does not read fast enough the whole frame
 * is dropped and counted in `status`, and its sequence number is used up. */
void link_send(uint8_t id, uint8_t body_length);

/* The port was opened: forgets half a frame of the last host and ends half a frame this board may have sent it. */
void link_open(void);

/* The next command among the bytes that have come; false when there is none (call again later). Bad frames are counted. */
bool link_receive(struct link_command *out);

#endif
