/* SPDX-License-Identifier: MIT */
/* Frames to and from the host: packed messages -> USB bytes, USB bytes -> commands. Owns the sequence number and the
 * unfinished frame from the host. */
#ifndef ECHOSTEP_LINK_H
#define ECHOSTEP_LINK_H

#include <stdbool.h>
#include <stdint.h>
#include "frame.h" /* FRAME_*, MSG_* */

/* A host frame with a correct checksum. */
struct link_command {
	uint8_t id;
	uint8_t length;
	const uint8_t *body; /* valid until the next call of link_receive */
};

/* Buffer into which the next message's body is packed: `link_send(MSG_PING, msg_pack_ping(link_body(), &ping))`. */
uint8_t *link_body(void);

/* Sends the packed body. While no host has the port open nothing is sent. When the send buffer has no room the whole
 * frame is dropped: it is counted in `status` and uses up its sequence number. */
void link_send(uint8_t id, uint8_t body_length);

/* To be called when the port was opened: drops an unfinished frame from the previous host, and sends a zero that ends
 * an unfinished frame to it. */
void link_open(void);

/* Takes the next command from the received bytes; false: there is none yet. Bad frames are counted. */
bool link_receive(struct link_command *out);

/* The optional messages (REPORTS_*) that the host wants, until the port is opened again; whether it wants any of
 * these. */
void link_subscribe(uint8_t reports);
bool link_wants(uint8_t reports);

#endif
