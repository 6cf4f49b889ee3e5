/* SPDX-License-Identifier: GPL-3.0-or-later
 * The board's port as a pseudo terminal that pyserial can open. DTR is on while a program has it open. Unplugging
 * removes the terminal. */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include "twin.h"

#define PACKET_MAX 64

static int master = -1;
static bool wanted;
static uint8_t waiting[PACKET_MAX]; /* the rest of a packet that the terminal had no room for */
static unsigned waiting_length;

bool pty_wanted(void)
{
	return wanted;
}

static void make_raw(const char *name)
{
	struct termios settings;
	int slave = open(name, O_RDWR | O_NOCTTY);

	if (slave < 0 || tcgetattr(slave, &settings))
		fail("cannot set up the pseudo terminal: %s", strerror(errno));
	cfmakeraw(&settings);
	tcsetattr(slave, TCSANOW, &settings);
	close(slave); /* from now on a hang-up on the master means that no program has it open */
}

void pty_open(void)
{
	wanted = true;
	master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
	if (master < 0 || grantpt(master) || unlockpt(master))
		fail("cannot make a pseudo terminal: %s", strerror(errno));
	make_raw(ptsname(master));
	bench_trace("board port %s", ptsname(master));
}

void pty_close(void)
{
	close(master);
	master = -1;
	waiting_length = 0;
	usb_host_open(false);
}

bool pty_has_room(void)
{
	return waiting_length == 0;
}

void pty_write(const uint8_t *bytes, unsigned length)
{
	ssize_t n = write(master, bytes, length);
	unsigned done = n < 0 ? 0 : (unsigned)n;

	waiting_length = length - done;
	memmove(waiting, bytes + done, waiting_length);
}

static void forward_bytes(void)
{
	uint8_t bytes[256];
	ssize_t n = read(master, bytes, sizeof bytes);

	if (n > 0)
		usb_host_send(bytes, (unsigned)n);
}

void pty_poll(void)
{
	struct pollfd p = { master, POLLIN, 0 };

	if (master < 0)
		return;
	poll(&p, 1, 0);

	bool open = !(p.revents & POLLHUP);

	usb_host_open(open);
	if (!open)
		waiting_length = 0;
	if (p.revents & POLLIN)
		forward_bytes();
	if (waiting_length)
		pty_write(waiting, waiting_length);
}
