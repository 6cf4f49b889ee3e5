/* SPDX-License-Identifier: MIT */
/* Main loop of the sensor board: moves USB bytes, carries out the host's commands, runs each sensor, then sleeps until
 * the earliest time that a sensor returned, or until an interrupt. Interrupts only latch; everything that takes time
 * happens here. */
#include "board.h"         /* start, clock, USB, sleep */
#include "compass.h"       /* sensor */
#include "configuration.h" /* carries out `configure` */
#include "electrical.h"    /* sent once a second */
#include "foot.h"          /* sensor of a foot board */
#include "gyros.h"         /* sensor */
#include "link.h"          /* messages to and from the host */
#include "parts.h"         /* sent once a second */
#include "pressure.h"      /* sensor */
#include "ranger.h"        /* sensor */
#include "selftest.h"      /* carries out `check_gyros` */
#include "status.h"        /* sent once a second */
#include "supply.h"        /* voltage */
#include "version.h"       /* sent in `identity` */

#define SLEEP_MAX_TICKS (5u * TICKS_PER_MS) /* a stuck bus is noticed within this time */

static void send_identity(void)
{
	struct msg_identity m = {
		clock_now(), SCHEMA_HASH, VERSION_MAJOR, VERSION_MINOR, VERSION_PATCH, restart_known()->cause,
	};
	link_send(MSG_IDENTITY, msg_pack_identity(link_body(), &m));
}

static void send_configuration(void)
{
	struct msg_configuration m = {
		.ticks = clock_now(),
		.sensors = configuration.sensors,
		.schedule = configuration.schedule,
		.gyro_rate_hz = configuration.gyro_rate_hz,
		.compass_rate_hz = configuration.compass_rate_hz,
		.pressure_mode = configuration.pressure_mode,
	};
	link_send(MSG_CONFIGURATION, msg_pack_configuration(link_body(), &m));
}

static void send_clock_reply(uint32_t ticks, uint16_t token)
{
	struct msg_clock_reply m = { ticks, token };
	link_send(MSG_CLOCK_REPLY, msg_pack_clock_reply(link_body(), &m));
}

static void send_status(void)
{
	status.ticks = clock_now();
	status.memory_used = board_memory_used();
	link_send(MSG_STATUS, msg_pack_status(link_body(), &status));
}

static void send_board_health(void)
{
	const struct restart *r = restart_known();
	struct msg_board_health m = {
		.ticks = clock_now(),
		.starts = r->starts,
		.crashes = r->crashes,
		.crash_place = r->crash_place,
		.crash_address = r->crash_address,
		.suspends = usb_suspends(),
	};
	supply_take(&m.supply_mv, &m.supply_least_mv);
	link_send(MSG_BOARD_HEALTH, msg_pack_board_health(link_body(), &m));
}

static void send_loop(void)
{
	struct msg_loop m = { .ticks = clock_now(), .ranging_cycle = (uint16_t)(ranger_cycle() / 8u) };
	board_take_timing(&m.longest_turn, &m.longest_latency);
	link_send(MSG_LOOP, msg_pack_loop(link_body(), &m));
}

/* The optional messages that come once a second. */
static void send_subscribed_reports(void)
{
	if (link_wants(REPORTS_BOARD_HEALTH))
		send_board_health();
	if (link_wants(REPORTS_PARTS))
		parts_send();
	if (link_wants(REPORTS_FOOT))
		foot_send_health();
	if (link_wants(REPORTS_ELECTRICAL))
		electrical_send();
	if (link_wants(REPORTS_LOOP))
		send_loop();
}

static void send_identity_and_configuration(void)
{
	send_identity();
	send_configuration();
}

/* At the start, and when the configuration changes. */
static void start_sensors(void)
{
	uint32_t now = clock_now();
	ranger_start(now);
	gyros_start(now);
	compass_start(now);
	pressure_start(now);
}

static bool handle_clock_query(const struct link_command *command, uint32_t ticks)
{
	struct msg_clock_query m;
	if (!msg_unpack_clock_query(&m, command->body, command->length))
		return false;
	send_clock_reply(ticks, m.token);
	return true;
}

static bool handle_configure(const struct link_command *command)
{
	struct msg_configure m;
	if (!msg_unpack_configure(&m, command->body, command->length))
		return false;
	configuration_set(&m);
	start_sensors();
	send_configuration();
	return true;
}

static bool handle_identify(const struct link_command *command)
{
	if (command->length != MSG_IDENTIFY_SIZE)
		return false;
	send_identity_and_configuration();
	return true;
}

static bool handle_check_gyros(const struct link_command *command)
{
	if (command->length != MSG_CHECK_GYROS_SIZE)
		return false;
	selftest_begin();
	return true;
}

static bool handle_subscribe(const struct link_command *command)
{
	struct msg_subscribe m;
	if (!msg_unpack_subscribe(&m, command->body, command->length))
		return false;
	link_subscribe(m.reports);
	send_subscribed_reports();
	return true;
}

/* Carries out a command; false: unknown id or wrong length. */
static bool handle_command(const struct link_command *command)
{
	switch (command->id) {
	case MSG_IDENTIFY:
		return handle_identify(command);
	case MSG_CLOCK_QUERY:
		return handle_clock_query(command, clock_now());
	case MSG_CONFIGURE:
		return handle_configure(command);
	case MSG_CHECK_GYROS:
		return handle_check_gyros(command);
	case MSG_SUBSCRIBE:
		return handle_subscribe(command);
	default:
		return false;
	}
}

static void handle_port_opening(void)
{
	if (!usb_take_opening())
		return;
	link_open();
	send_identity_and_configuration();
}

static void receive_commands(void)
{
	struct link_command command;
	if (link_receive(&command) && !handle_command(&command))
		status.bad_frames++;
	if (usb_bootloader_wanted())
		board_bootloader();
}

/* An edge is a sample of the foot's part, or a SyncOut pulse. */
static void take_edge(void)
{
	struct capture_edge e;
	if (!capture_take_edge(&e) || foot_take(&e) || !configuration_reads(SENSORS_SYNC))
		return;
	status.dropped_sync = (uint16_t)(status.dropped_sync + e.missed);
	struct msg_sync m = { e.ticks, e.edge };
	link_send(MSG_SYNC, msg_pack_sync(link_body(), &m));
}

static uint32_t reports_due;

/* Sends the reports of each second when due; returns the time of the next call. */
static uint32_t send_each_second(uint32_t now)
{
	if (!ticks_reached(now, reports_due))
		return reports_due;
	send_identity();
	send_status();
	send_subscribed_reports();
	reports_due += TICKS_PER_S;
	return reports_due;
}

/* The earlier of two times, which are less than 17.9 minutes apart. */
static uint32_t earlier(uint32_t a, uint32_t b)
{
	return ticks_reached(a, b) ? b : a;
}

/* Runs what is due; returns the earliest time at which something is due next. */
static uint32_t run_sensors(void)
{
	uint32_t now = clock_now();
	uint32_t wake = now + SLEEP_MAX_TICKS;
	restart_enter(CRASH_PLACE_BUS);
	if (twi_watch(now))
		status.bus_recoveries++;
	restart_enter(CRASH_PLACE_RANGER);
	wake = earlier(wake, ranger_run(now));
	restart_enter(CRASH_PLACE_GYROS);
	wake = earlier(wake, gyros_run(now));
	if (foot_run(now))
		send_configuration();
	restart_enter(CRASH_PLACE_COMPASS);
	wake = earlier(wake, compass_run(now));
	restart_enter(CRASH_PLACE_PRESSURE);
	wake = earlier(wake, pressure_run(now));
	restart_enter(CRASH_PLACE_SUPPLY);
	supply_run();
	electrical_run();
	restart_enter(CRASH_PLACE_REPORTS);
	return earlier(wake, send_each_second(now));
}

/* The lamp changes every 0.52 s, every 0.07 s while a part that is to be read has not answered. */
static void beat(void)
{
	uint8_t wanted = configuration.sensors & (uint8_t)~SENSORS_SYNC;
	bool well = (status.healthy & wanted) == wanted && foot_is_well();
	board_lamp((clock_now() >> (well ? 20 : 17)) & 1u);
}

/* A restart that was not wanted happens during a walk: no self-test then. */
static bool was_started_on_purpose(void)
{
	return !(restart_known()->cause & (RESET_CAUSE_WATCHDOG | RESET_CAUSE_BROWN_OUT));
}

int main(void)
{
	board_start();
	reports_due = clock_now();
	foot_start(reports_due);
	start_sensors();
	if (was_started_on_purpose())
		selftest_begin();
	for (;;) {
		restart_enter(CRASH_PLACE_USB);
		usb_run(); /* received bytes */
		restart_enter(CRASH_PLACE_COMMANDS);
		handle_port_opening();
		receive_commands();
		take_edge();
		uint32_t wake = run_sensors();
		beat();
		restart_enter(CRASH_PLACE_USB);
		usb_run(); /* the messages just made */
		restart_enter(CRASH_PLACE_SLEEP);
		board_sleep(wake);
	}
}
