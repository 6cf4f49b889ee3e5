/* SPDX-License-Identifier: MIT */
/* Feeds bytes to the firmware's codec: as a USB stream into link_receive, as a payload through COBS and back, and as a
 * message into a send buffer of any size. With libFuzzer only (make fuzz). */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "board.h"
#include "link.h"
#include "status.h"

#define LONGEST 600u
#define MUST(condition) ((condition) ? (void)0 : broken(#condition, __LINE__))

static const uint8_t *incoming;
static size_t incoming_length, incoming_index;
static uint8_t sent[FRAME_ENCODED_MAX];
static uint8_t sent_length, room;

static void broken(const char *condition, int line)
{
	fprintf(stderr, "line %d: %s does not hold\n", line, condition);
	abort();
}

/* The board: a port that returns the bytes of `incoming` and accepts at most `room` bytes. */
bool usb_is_open(void)
{
	return true;
}

bool usb_write(const uint8_t *bytes, uint8_t length)
{
	MUST(length <= sizeof sent);
	sent_length = length <= room ? length : 0;
	memcpy(sent, bytes, sent_length);
	return length <= room;
}

int16_t usb_read(void)
{
	return incoming_index < incoming_length ? (int16_t)incoming[incoming_index++] : (int16_t)-1;
}

static void check_receive(const uint8_t *bytes, size_t length)
{
	unsigned zeros = 0, commands = 0;
	uint16_t bad = status.bad_frames;
	struct link_command command;
	for (size_t i = 0; i < length; i++)
		zeros += bytes[i] == 0;
	incoming = bytes;
	incoming_length = length;
	incoming_index = 0;
	link_open();
	while (incoming_index < incoming_length) {
		if (!link_receive(&command))
			continue;
		uint8_t copy[MSG_MAX_SIZE];
		MUST(command.length <= MSG_CONFIGURE_SIZE);
		memcpy(copy, command.body, command.length); /* the sanitizer detects a read outside */
		commands++;
	}
	MUST(commands + (uint16_t)(status.bad_frames - bad) <= zeros);
}

static void check_cobs(const uint8_t *bytes, uint16_t length)
{
	static uint8_t encoded[COBS_ENCODED_MAX(LONGEST)], decoded[COBS_ENCODED_MAX(LONGEST)];
	uint16_t encoded_length = cobs_encode(encoded, bytes, length);
	MUST(encoded_length <= COBS_ENCODED_MAX(length));
	MUST(memchr(encoded, 0, encoded_length) == NULL);
	MUST(cobs_decode(decoded, encoded, encoded_length) == length && memcmp(decoded, bytes, length) == 0);
	MUST(cobs_decode(decoded, bytes, length) < length || length == 0);
}

/* Either the whole frame is sent or nothing, and a sent frame can be decoded. */
static void check_send(uint8_t id, const uint8_t *body, uint8_t length, uint8_t free_bytes)
{
	uint16_t other = status.dropped_other, ping = status.dropped_ping;
	room = free_bytes;
	memcpy(link_body(), body, length);
	link_send(id, length);
	room = UINT8_MAX;
	if (!sent_length) {
		MUST(id == MSG_PING ? status.dropped_ping == (uint16_t)(ping + 1) : status.dropped_ping == ping);
		return;
	}
	MUST(status.dropped_ping == ping && status.dropped_other == other);
	MUST(sent[sent_length - 1] == 0);
	MUST(frame_decode(sent, (uint8_t)(sent_length - 1)) == length);
	MUST(sent[0] == id && memcmp(sent + FRAME_HEAD_SIZE, body, length) == 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length)
{
	room = UINT8_MAX;
	if (length > LONGEST)
		length = LONGEST;
	check_receive(bytes, length);
	check_cobs(bytes, (uint16_t)length);
	if (length >= 2)
		check_send(bytes[0], bytes + 2, (uint8_t)(length - 2 > MSG_MAX_SIZE ? MSG_MAX_SIZE : length - 2), bytes[1]);
	return 0;
}
