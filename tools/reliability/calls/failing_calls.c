// SPDX-License-Identifier: MIT
// Calls of the operating system, of which the n-th fails: preloaded into a process (LD_PRELOAD), which arms it.
//
// In: `fail_call` by the process itself. Out: the calls of one kind (output, files, ports, sockets) as they are, but for the chosen ones, which
// return an error. A close that fails has closed all the same. Owns what each file descriptor is, and the count.

#define _GNU_SOURCE
#include <dlfcn.h>      // the functions that are replaced
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>     // the mode of open
#include <stdatomic.h>  // calls of several threads
#include <string.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

enum Kind { NONE, OUTPUT, FILES, PORTS, SOCKETS };
enum { DESCRIPTORS = 4096, PATH = 4096 };

static _Atomic unsigned char kind_of[DESCRIPTORS];
static char folder[PATH];
static _Atomic int armed_kind, armed_error, lasting;
static _Atomic long armed_call, calls;

// Let the call number `call` of a kind fail with `error`, and with `lasts` all after it; files are those in `files_folder`.
void fail_call(int kind, long call, int error, int lasts, const char *files_folder)
{
	strncpy(folder, files_folder, PATH - 1);
	calls = 0;
	armed_call = call;
	armed_error = error;
	lasting = lasts;
	armed_kind = kind;
}

// Calls of the kind since then.
long calls_made(void)
{
	return calls;
}

static int fails(int kind)
{
	if (kind == NONE || kind != armed_kind)
		return 0;
	long call = ++calls;
	if (call != armed_call && !(lasting && armed_call && call > armed_call))
		return 0;
	errno = armed_error;
	return 1;
}

static int kind(int fd)
{
	if (fd == 1 || fd == 2)
		return OUTPUT;
	return fd >= 0 && fd < DESCRIPTORS ? kind_of[fd] : NONE;
}

static int kind_of_path(const char *path)
{
	if (folder[0] && !strncmp(path, folder, strlen(folder)))
		return FILES;
	return strncmp(path, "/dev/pts/", 9) ? NONE : PORTS;
}

static int made(int fd, int kind)
{
	if (fd >= 0 && fd < DESCRIPTORS)
		kind_of[fd] = (unsigned char)kind;
	return fd;
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))
#define FORWARD(type, name, parameters, arguments, fd) \
	type name parameters                           \
	{                                              \
		return fails(kind(fd)) ? (type)-1 : REAL(name) arguments; \
	}
#define OPEN(name, first, path, arguments)                          \
	int name first                                              \
	{                                                           \
		va_list list;                                       \
		va_start(list, flags);                              \
		mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(list, mode_t) : 0; \
		va_end(list);                                       \
		int of = kind_of_path(path);                        \
		return fails(of) ? -1 : made(REAL(name) arguments, of); \
	}

OPEN(open, (const char *path, int flags, ...), path, (path, flags, mode))
OPEN(open64, (const char *path, int flags, ...), path, (path, flags, mode))
OPEN(openat, (int at, const char *path, int flags, ...), path, (at, path, flags, mode))
OPEN(openat64, (int at, const char *path, int flags, ...), path, (at, path, flags, mode))
FORWARD(ssize_t, write, (int fd, const void *data, size_t size), (fd, data, size), fd)
FORWARD(ssize_t, pwrite64, (int fd, const void *data, size_t size, off64_t at), (fd, data, size, at), fd)
FORWARD(ssize_t, writev, (int fd, const struct iovec *data, int count), (fd, data, count), fd)
FORWARD(ssize_t, read, (int fd, void *data, size_t size), (fd, data, size), fd)
FORWARD(int, fsync, (int fd), (fd), fd)
FORWARD(int, fdatasync, (int fd), (fd), fd)
FORWARD(ssize_t, send, (int fd, const void *data, size_t size, int flags), (fd, data, size, flags), fd)
FORWARD(ssize_t, sendmsg, (int fd, const struct msghdr *data, int flags), (fd, data, flags), fd)
FORWARD(ssize_t, recv, (int fd, void *data, size_t size, int flags), (fd, data, size, flags), fd)
FORWARD(ssize_t, recvfrom, (int fd, void *data, size_t size, int flags, struct sockaddr *from, socklen_t *length),
	(fd, data, size, flags, from, length), fd)
FORWARD(int, bind, (int fd, const struct sockaddr *address, socklen_t length), (fd, address, length), fd)
FORWARD(int, listen, (int fd, int backlog), (fd, backlog), fd)
FORWARD(int, connect, (int fd, const struct sockaddr *address, socklen_t length), (fd, address, length), fd)

int socket(int family, int type, int protocol)
{
	return fails(SOCKETS) ? -1 : made(REAL(socket)(family, type, protocol), SOCKETS);
}

int accept4(int fd, struct sockaddr *address, socklen_t *length, int flags)
{
	return fails(kind(fd)) ? -1 : made(REAL(accept4)(fd, address, length, flags), SOCKETS);
}

int rename(const char *from, const char *to)
{
	return fails(kind_of_path(to)) ? -1 : REAL(rename)(from, to);
}

int link(const char *from, const char *to)
{
	return fails(kind_of_path(to)) ? -1 : REAL(link)(from, to);
}

int close(int fd)
{
	int failed = fails(fd > 2 ? kind(fd) : NONE), status, error = errno;
	made(fd, NONE);
	status = REAL(close)(fd);
	if (failed)
		errno = error;
	return failed ? -1 : status;
}
