/* SPDX-License-Identifier: MIT */
#include "cmps10.h"
#include "link.h"  /* sending the messages */
#include "parts.h" /* what was found */

/* Bearing in 0.1 degrees, big-endian, in registers 2 and 3 [Devantech CMPS10 documentation]. */
#define ADDRESS 0x60u
#define REGISTER_BEARING 2u
#define BEARING_MAX 3599u

void cmps10_prepare(struct twi_transfer *transfer)
{
	transfer->address = ADDRESS;
	transfer->write_length = 1;
	transfer->read_length = 2;
	transfer->bytes[0] = REGISTER_BEARING;
}

static void report(uint32_t ticks, uint16_t bearing)
{
	struct msg_compass m = { ticks, bearing };
	link_send(MSG_COMPASS, msg_pack_compass(link_body(), &m));
}

uint8_t cmps10_finish(const struct twi_transfer *transfer)
{
	uint16_t bearing = (uint16_t)((uint16_t)transfer->bytes[0] << 8 | transfer->bytes[1]);
	if (bearing > BEARING_MAX) {
		cmps10_send_none(transfer->ticks);
		return FAULT_BAD_VALUE;
	}
	parts_found(DEVICE_COMPASS, PART_CMPS10, 0);
	report(transfer->ticks, bearing);
	return FAULT_NONE;
}

void cmps10_send_none(uint32_t now)
{
	report(now, MSG_COMPASS_BEARING_INVALID);
}
