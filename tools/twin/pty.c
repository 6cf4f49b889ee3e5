/* SPDX-License-Identifier: GPL-3.0-or-later
 * The board's port as a pseudo terminal that pyserial opens. DTR is up while somebody has it open. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include "twin.h"

static int master = -1;
static uint8_t waiting[256];
static unsigned waiting_length;

bool pty_wanted(void)
{
	return master >= 0;
}

void pty_open(void)
{
	struct termios raw;
	int slave;

	master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
	if (master < 0 || grantpt(master) || unlockpt(master))
		fail("cannot make a pseudo terminal: %s", strerror(errno));
	slave = open(ptsname(master), O_RDWR | O_NOCTTY);
	if (slave < 0 || tcgetattr(slave, &raw))
		fail("cannot set up the pseudo terminal: %s", strerror(errno));
	cfmakeraw(&raw);
	tcsetattr(slave, TCSANOW, &raw);
	close(slave); /* from now on a hang-up on the master means that nobody has it open */
	fprintf(stderr, "board port: %s\n", ptsname(master));
}

bool pty_write(const uint8_t *bytes, unsigned length)
{
	ssize_t n = write(master, bytes, length);
	unsigned done = n < 0 ? 0 : (unsigned)n;

	if (done < length) { /* keep the rest of this packet; the host takes no more until it is gone */
		waiting_length = length - done;
		memcpy(waiting, bytes + done, waiting_length);
		return false;
	}
	return true;
}

void pty_poll(void)
{
	struct pollfd p = { master, POLLIN, 0 };
	uint8_t bytes[256];

	poll(&p, 1, 0);
	usb_host_open(!(p.revents & POLLHUP));
	if (p.revents & POLLIN) {
		ssize_t n = read(master, bytes, sizeof bytes);

		if (n > 0)
			usb_host_send(bytes, (unsigned)n);
	}
	if (waiting_length) {
		unsigned length = waiting_length;
		uint8_t rest[sizeof waiting];

		memcpy(rest, waiting, length);
		waiting_length = 0;
		if (pty_write(rest, length))
			usb_host_stall(false);
	}
}
