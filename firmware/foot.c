/* SPDX-License-Identifier: MIT */
#include "foot.h"
#include "configuration.h" /* switching the other sensors off */
#include "icm20649.h"      /* driver */
#include "link.h"          /* sending the messages */
#include "parts.h"         /* what was found */

#define CHIP CHIP_THIGH
/* before the rangers' first slot: the left echo line is the data-ready line */
#define SEEK_FIRST_TICKS (90u * TICKS_PER_MS)
#define SEEK_TICKS (200u * TICKS_PER_MS)      /* between two searches; a start takes 11 to 100 ms */
#define RESET_TICKS (100u * TICKS_PER_MS)     /* start-up time [DS-000192, table 5] */
#define FIRST_SAMPLE_TICKS (200u * TICKS_PER_MS) /* gyros need 35 ms */
#define SILENT_TICKS (100u * TICKS_PER_MS)    /* 22 samples without an edge: the part has failed */
#define IDLE_HIGH 0xFFu                       /* an absent part reads as ones, or as zeros */

static struct msg_foot_health health = { .temperature = MSG_FOOT_HEALTH_TEMPERATURE_INVALID };
static uint32_t due; /* ticks */
static bool is_set;                     /* whether the part has its settings */

void foot_start(uint32_t now)
{
	due = now + SEEK_FIRST_TICKS;
}

static bool is_foot_board(void)
{
	return parts_in(PLACE_FOOT) == PART_ICM20649;
}

static void fail(uint32_t now, uint8_t fault)
{
	health.foot_state = FOOT_STATE_SOUGHT;
	health.fault = fault;
	health.errors++;
	due = now + SEEK_TICKS;
}

/* Not on a board that has found a ranger, a compass or a gyro since its start. */
static bool may_be_here(void)
{
	for (uint8_t place = DEVICE_RANGER_LEFT; place < DEVICE_PRESSURE; place++)
		if (parts_in(place) != PART_NONE)
			return is_foot_board();
	return true;
}

static bool seek(uint32_t now)
{
	static bool gyros_sought; /* at the first search an ADIS16100 may be here, whose reply is not an identity */
	bool first = !is_foot_board(), is_known = gyros_sought;
	due = now + SEEK_TICKS;
	gyros_sought = true;
	if (!may_be_here())
		return false;
	if (!icm20649_answers(CHIP)) {
		uint8_t identity = icm20649_identity(CHIP);
		if (!first)
			fail(now, FAULT_NO_ANSWER);
		else if (is_known && identity && identity != IDLE_HIGH)
			parts_found(PLACE_FOOT, PART_NONE, identity);
		return false;
	}
	parts_found(PLACE_FOOT, PART_ICM20649, ICM20649_IDENTITY);
	configuration.sensors = 0;
	usb_name_foot();
	icm20649_reset(CHIP);
	health.foot_state = FOOT_STATE_STARTING;
	is_set = false;
	due = now + RESET_TICKS;
	return first;
}

bool foot_run(uint32_t now)
{
	if (!ticks_reached(now, due))
		return false;
	if (health.foot_state == FOOT_STATE_SOUGHT)
		return seek(now);
	if (!is_set) {
		icm20649_start(CHIP);
		is_set = true;
		due = now + FIRST_SAMPLE_TICKS;
	} else {
		fail(now, icm20649_answers(CHIP) ? FAULT_NEVER_READY : FAULT_NO_ANSWER);
	}
	return false;
}

static void note_wrong_bits(void)
{
	health.fault = FAULT_BAD_VALUE;
	health.errors++;
}

static void send(const struct capture_edge *edge, const int16_t *a)
{
	struct msg_foot m = { edge->ticks, edge->edge, a[3], a[4], a[5], a[0], a[1], a[2] };
	link_send(MSG_FOOT, msg_pack_foot(link_body(), &m));
}

bool foot_take(const struct capture_edge *edge)
{
	struct icm20649_sample sample;
	if (!is_foot_board())
		return false;
	if (health.foot_state == FOOT_STATE_SOUGHT || !is_set)
		return true;
	uint8_t fault = icm20649_read(CHIP, &sample);
	if (fault == FAULT_NO_ANSWER) {
		fail(edge->ticks, fault);
		return true;
	}
	due = edge->ticks + SILENT_TICKS;
	if (fault != FAULT_NONE) {
		note_wrong_bits();
		return true;
	}
	health.foot_state = FOOT_STATE_RUNNING;
	health.missed = (uint16_t)(health.missed + edge->missed);
	health.temperature = sample.temperature;
	if (link_wants(REPORTS_FOOT))
		send(edge, sample.axes);
	return true;
}

/* Settings may have arrived with a wrong bit, or been lost: they are read back, and written anew. */
static void check_settings(void)
{
	if (health.foot_state != FOOT_STATE_RUNNING || icm20649_is_set(CHIP))
		return;
	icm20649_start(CHIP);
	note_wrong_bits();
}

bool foot_is_well(void)
{
	return !is_foot_board() || health.foot_state == FOOT_STATE_RUNNING;
}

void foot_send_health(void)
{
	if (!is_foot_board())
		return;
	check_settings();
	health.ticks = clock_now();
	link_send(MSG_FOOT_HEALTH, msg_pack_foot_health(link_body(), &health));
}
