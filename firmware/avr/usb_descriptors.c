/* SPDX-License-Identifier: MIT */
/* USB descriptors: one CDC-ACM port [USB 2.0, chapter 9; CDC120; PSTN120]. All in flash, except the serial number,
 * which is made of the chip's own number. */
#include <avr/boot.h>     /* signature row */
#include <avr/pgmspace.h> /* PROGMEM */
#include <util/atomic.h>  /* ATOMIC_BLOCK */
#include "../version.h"   /* release number */
#include "../board.h"     /* usb_name_foot */
#include "usb.h"

/* pid.codes reserves 0x1209:0x0001 for tests; hosts know the board by its strings of maker and product. */
static const uint8_t device_descriptor[] PROGMEM = {
	18, 1, 0x00, 0x02,      /* USB 2.0 */
	2, 2, 0, EP_SIZE,       /* class and subclass by which Windows 10 and later load their driver, usbser.sys */
	0x09, 0x12, 0x01, 0x00, /* vendor, product */
	VERSION_MINOR << 4 | VERSION_PATCH, VERSION_MAJOR, /* release, binary-coded decimal */
	1, 2, 3, 1,             /* strings of maker, product and serial number; one configuration */
};

#define CONFIGURATION_SIZE 67
static const uint8_t configuration_descriptor[] PROGMEM = {
	9, 2, CONFIGURATION_SIZE, 0, 2, 1, 0, 0x80, 50,      /* two interfaces, bus powered, 100 mA */
	/* communications interface, abstract control model, no AT commands; its string */
	9, 4, 0, 0, 1, 2, 2, 0, 4,
	5, 0x24, 0, 0x10, 0x01,                              /* CDC 1.10 */
	5, 0x24, 1, 0, 1,                                    /* no call management */
	4, 0x24, 2, 2,                                       /* line coding and line state */
	5, 0x24, 6, 0, 1,                                    /* union of interfaces 0 and 1 */
	7, 5, EP_NOTIFY | 0x80, 3, NOTIFY_SIZE, 0, 64,       /* unused, but required by the class */
	9, 4, 1, 0, 2, 0x0A, 0, 0, 0,                        /* data interface */
	7, 5, EP_OUT, 2, EP_SIZE, 0, 0,
	7, 5, EP_IN | 0x80, 2, EP_SIZE, 0, 0,
};
_Static_assert(sizeof configuration_descriptor == CONFIGURATION_SIZE, "wTotalLength");

static const uint8_t languages[] PROGMEM = { 4, 3, 0x09, 0x04 };
static const uint8_t maker[] PROGMEM = { 18, 3, 'e', 0, 'c', 0, 'h', 0, 'o', 0, 's', 0, 't', 0, 'e', 0, 'p', 0 };
static const uint8_t product[] PROGMEM = {
	26, 3, 's', 0, 'e', 0, 'n', 0, 's', 0, 'o', 0, 'r', 0, ' ', 0, 'b', 0, 'o', 0, 'a', 0, 'r', 0, 'd', 0,
};

/* Which board of a kit it is: read after the port was debounced for 100 ms, when the foot's part has been sought, so
 * that udev gives each board its name. */
static const uint8_t foot[] PROGMEM = { 10, 3, 'f', 0, 'o', 0, 'o', 0, 't', 0 };
static const uint8_t belt[] PROGMEM = { 10, 3, 'b', 0, 'e', 0, 'l', 0, 't', 0 };
static bool is_foot;

void usb_name_foot(void)
{
	is_foot = true;
}

/* The chip's lot, wafer and place on it: ten bytes of the signature row, of which the data sheet is silent and which
 * LUFA reads too. */
#define CHIP_NUMBER 0x0Eu
#define SERIAL_DIGITS 20u
#define SERIAL_SIZE (2u + 2u * SERIAL_DIGITS)
#define STRING 3u

static uint8_t hex_digit(uint8_t nibble)
{
	return (uint8_t)(nibble < 10u ? '0' + nibble : 'A' - 10 + nibble);
}

/* A byte of the string descriptor: length, type, then two bytes a digit. */
static uint8_t serial_byte(uint8_t index)
{
	if (index < 2u)
		return index ? STRING : SERIAL_SIZE;
	if (index & 1u)
		return 0;
	uint8_t digit = (uint8_t)(index / 2u - 1u), byte = 0;
	ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
	{
		byte = boot_signature_byte_get(CHIP_NUMBER + digit / 2u);
	}
	return hex_digit(digit & 1u ? byte & 0x0Fu : byte >> 4);
}

struct descriptor {
	const uint8_t *bytes; /* 0: made by serial_byte */
	uint8_t length;
};

static struct descriptor find(uint16_t value)
{
	switch (value) {
	case 0x0100:
		return (struct descriptor){ device_descriptor, sizeof device_descriptor };
	case 0x0200:
		return (struct descriptor){ configuration_descriptor, sizeof configuration_descriptor };
	case 0x0300:
		return (struct descriptor){ languages, sizeof languages };
	case 0x0301:
		return (struct descriptor){ maker, sizeof maker };
	case 0x0302:
		return (struct descriptor){ product, sizeof product };
	case 0x0304:
		return (struct descriptor){ is_foot ? foot : belt, sizeof foot };
	case 0x0303:
		return (struct descriptor){ 0, SERIAL_SIZE };
	default:
		return (struct descriptor){ 0, 0 };
	}
}

uint8_t usb_descriptor_length(uint16_t value)
{
	return find(value).length;
}

uint8_t usb_descriptor_byte(uint16_t value, uint8_t index)
{
	const uint8_t *bytes = find(value).bytes;
	return bytes ? pgm_read_byte(bytes + index) : serial_byte(index);
}
