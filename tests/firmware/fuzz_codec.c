/* SPDX-License-Identifier: MIT */
/* Feeds bytes to the firmware's codec: as a USB stream into link_receive, as a payload through COBS and back, and as a
 * message into a send buffer of any size. With libFuzzer (clang -fsanitize=fuzzer -DLIBFUZZER), or alone: ./fuzz SEED
 * COUNT. */
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

#ifndef LIBFUZZER
static uint64_t state;

/* splitmix64 [Steele, Lea, Flood 2014] */
static uint32_t below(uint32_t limit)
{
	uint64_t z = state += 0x9E3779B97F4A7C15ull;
	z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
	z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
	return (uint32_t)((z ^ (z >> 31)) % limit);
}

/* A stream of frames from the host, most of them whole, some with a flipped byte. */
static size_t frames(uint8_t *out)
{
	size_t end = 0;
	while (end < LONGEST / 2) {
		uint8_t payload[FRAME_PAYLOAD_MAX];
		for (uint8_t i = 0; i < sizeof payload; i++)
			payload[i] = (uint8_t)below(3);
		uint8_t id = (uint8_t)(MSG_IDENTIFY + below(4));
		end += frame_encode(out + end, payload, id, (uint16_t)below(65536), (uint8_t)below(7));
		if (below(4) == 0)
			out[end - 1 - below(5)] ^= (uint8_t)(1u << below(8));
	}
	return end;
}

static size_t noise(uint8_t *out)
{
	uint32_t length = below(LONGEST), values = 1 + below(256);
	for (uint32_t i = 0; i < length; i++)
		out[i] = (uint8_t)below(values);
	return length;
}

int main(int argc, char **argv)
{
	static uint8_t bytes[2 * LONGEST];
	if (argc != 3)
		return 2;
	state = strtoull(argv[1], NULL, 0);
	for (long left = strtol(argv[2], NULL, 0); left > 0; left--)
		LLVMFuzzerTestOneInput(bytes, left % 2 ? frames(bytes) : noise(bytes));
	return 0;
}
#endif
