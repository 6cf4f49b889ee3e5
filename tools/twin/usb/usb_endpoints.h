/* SPDX-License-Identifier: GPL-3.0-or-later
 * The endpoints of the device controller: what its registers (usb_device.c) and its transactions (usb_transactions.c)
 * share. */
#ifndef ECHOSTEP_TWIN_USB_ENDPOINTS_H
#define ECHOSTEP_TWIN_USB_ENDPOINTS_H

#include "twin.h"

enum {
	UHWCON = 0xD7, USBCON, USBSTA, USBINT, UDCON = 0xE0, UDINT, UDIEN, UDADDR, UDFNUML, UDFNUMH, UDMFN,
	UEINTX = 0xE8, UENUM, UERST, UECONX, UECFG0X, UECFG1X, UESTA0X, UESTA1X, UEIENX, UEDATX, UEBCLX, UEBCHX, UEINT,
};
enum { TXINI = 1, STALLEDI = 2, RXOUTI = 4, RXSTPI = 8, NAKOUTI = 16, RWAL = 32, NAKINI = 64, FIFOCON = 128 };
enum { USBE = 0x80, FRZCLK = 0x20, OTGPADE = 0x10, VBUS = 1, VBUSTI = 1, VBUSTE = 1, DETACH = 1 };
enum { PLLCSR = 0x49, PLOCK = 1, UVREGE = 1 };
enum { EPEN = 1, RSTDT = 8, STALLRQC = 16, STALLRQ = 32, ALLOC = 2, ADDEN = 0x80 };
#define ENDPOINTS 7
#define BANK_SIZE 64 /* maximum of full speed for control and bulk */

struct bank {
	uint8_t bytes[BANK_SIZE];
	int length, read;
	bool full; /* holds a packet, which the cable (IN) or the program (OUT) has to fetch */
};

extern struct endpoint {
	uint8_t conx, cfg0, cfg1, enabled, flags;
	bool stalled;
	bool toggle; /* of the next packet, sent or expected; a control endpoint: of IN */
	struct bank bank[2]; /* of a control endpoint: 0 is OUT and SETUP, 1 is IN */
	int cpu, cable;      /* bank on which each side works */
} usb_endpoints[ENDPOINTS];

void usb_refresh(void); /* the interrupts, from flags and levels */
void usb_offer_bank(struct endpoint *e); /* to the program, when the cable has left it one */

static inline bool is_in(const struct endpoint *e) { return e->cfg0 & 1; }
static inline bool is_control(const struct endpoint *e) { return (e->cfg0 >> 6) == 0; }
static inline int size_of(const struct endpoint *e)
{
	int size = 8 << ((e->cfg1 >> 4) & 7);

	return size < BANK_SIZE ? size : BANK_SIZE;
}
static inline int banks_of(const struct endpoint *e) { return (e->cfg1 >> 2) & 3 ? 2 : 1; }

#endif
