/* The sensor board's main loop: every sensor gets its turn, the host's commands are obeyed, and the processor sleeps until the
 * earliest time somebody asked for. Interrupts only latch; everything that takes time happens here. */
#include "adis16100.h"
#include "board.h"
#include "compass.h"
#include "configuration.h"
#include "link.h"
#include "ranger.h"
#include "scp1000.h"
#include "selftest.h"
#include "status.h"

#define VERSION_MAJOR 1
#define VERSION_MINOR 1
#define VERSION_PATCH 0

#define NAP_TICKS (5u * TICKS_PER_MS) /* a stuck bus is noticed no later than that */

static void send_identity(void)
{
	struct msg_identity m = {
		clock_now(), SCHEMA_HASH, VERSION_MAJOR, VERSION_MINOR, VERSION_PATCH, board_reset_cause(),
	};
	link_send(MSG_IDENTITY, pack_identity(link_body(), &m));
}

static void send_configuration(void)
{
	struct msg_configuration m = {
		clock_now(),
		configuration.sensors,
		configuration.schedule,
		configuration.gyro_rate_hz,
		configuration.compass_rate_hz,
		configuration.pressure_mode,
	};
	link_send(MSG_CONFIGURATION, pack_configuration(link_body(), &m));
}

static void send_clock_reply(uint32_t ticks, uint16_t token)
{
	struct msg_clock_reply m = { ticks, token };
	link_send(MSG_CLOCK_REPLY, pack_clock_reply(link_body(), &m));
}

static void send_status(void)
{
	status.ticks = clock_now();
	status.memory_used = board_memory_used();
	link_send(MSG_STATUS, pack_status(link_body(), &status));
}

static void introduce(void)
{
	send_identity();
	send_configuration();
}

static void start_sensors(void)
{
	uint32_t now = clock_now();
	ranger_start(now);
	gyros_start(now);
	compass_start(now);
	pressure_start(now);
}

static bool obey_clock_query(const struct link_command *command, uint32_t ticks)
{
	struct msg_clock_query m;
	if (!unpack_clock_query(&m, command->body, command->length))
		return false;
	send_clock_reply(ticks, m.token);
	return true;
}

static bool obey_configure(const struct link_command *command)
{
	struct msg_configure m;
	if (!unpack_configure(&m, command->body, command->length))
		return false;
	configuration_set(&m);
	start_sensors();
	send_configuration();
	return true;
}

static bool obey_identify(const struct link_command *command)
{
	if (command->length != MSG_IDENTIFY_SIZE)
		return false;
	introduce();
	return true;
}

static bool obey_check_gyros(const struct link_command *command)
{
	if (command->length != MSG_CHECK_GYROS_SIZE)
		return false;
	selftest_begin();
	return true;
}

static bool obey(const struct link_command *command)
{
	switch (command->id) {
	case MSG_IDENTIFY:
		return obey_identify(command);
	case MSG_CLOCK_QUERY:
		return obey_clock_query(command, clock_now());
	case MSG_CONFIGURE:
		return obey_configure(command);
	case MSG_CHECK_GYROS:
		return obey_check_gyros(command);
	default:
		return false;
	}
}

static void greet_new_host(void)
{
	if (!usb_opened())
		return;
	link_open();
	introduce();
}

static void listen(void)
{
	struct link_command command;
	if (link_receive(&command) && !obey(&command))
		status.bad_frames++;
	if (usb_bootloader_wanted())
		board_bootloader();
}

static void report_edge(void)
{
	struct clock_edge e;
	if (!clock_take_edge(&e) || !configuration_reads(SENSORS_SYNC))
		return;
	status.dropped_sync = (uint16_t)(status.dropped_sync + e.missed);
	struct msg_sync m = { e.ticks, e.edge };
	link_send(MSG_SYNC, pack_sync(link_body(), &m));
}

static uint32_t report_each_second(uint32_t now)
{
	static uint32_t due;
	if (!ticks_reached(now, due))
		return due;
	send_identity();
	send_status();
	due += TICKS_PER_S;
	return due;
}

static uint32_t earlier(uint32_t a, uint32_t b)
{
	return ticks_reached(a, b) ? b : a;
}

static uint32_t run_sensors(void)
{
	uint32_t now = clock_now();
	uint32_t wake = now + NAP_TICKS;
	if (twi_watch(now))
		status.bus_recoveries++;
	wake = earlier(wake, ranger_run(now));
	wake = earlier(wake, gyros_run(now));
	wake = earlier(wake, compass_run(now));
	wake = earlier(wake, pressure_run(now));
	return earlier(wake, report_each_second(now));
}

int main(void)
{
	board_start();
	start_sensors();
	if (!(board_reset_cause() & RESET_CAUSE_WATCHDOG)) /* that one comes in mid-walk */
		selftest_begin();
	for (;;) {
		usb_run(); /* what came in */
		greet_new_host();
		listen();
		report_edge();
		uint32_t wake = run_sensors();
		usb_run(); /* what goes out */
		board_sleep(wake);
	}
}
