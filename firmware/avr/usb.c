/* SPDX-License-Identifier: MIT */
/* USB device controller of the ATmega32U4 [datasheet, chapters 21 and 22]: attach, bus reset, and the port's two bulk
 * endpoints. An interrupt only disables itself and wakes the main loop; usb_run does the work and enables it again. */
#include <avr/interrupt.h> /* ISR */
#include <avr/io.h>        /* registers */
#include "shared.h"
#include "usb.h"

#define PLL_TRIES 60000u /* 15 ms; the PLL locks within 0.1 ms */

#define TYPE_BULK_OUT (BIT(EPTYPE1))
#define TYPE_BULK_IN (BIT(EPTYPE1) | BIT(EPDIR))
#define TYPE_INTERRUPT_IN (BIT(EPTYPE1) | BIT(EPTYPE0) | BIT(EPDIR))
#define MEMORY_16 (BIT(EPSIZE0) | BIT(ALLOC))
#define MEMORY_64_DOUBLE (BIT(EPSIZE1) | BIT(EPSIZE0) | BIT(EPBK0) | BIT(ALLOC))

/* Values of UEINTX that hand over a bank: FIFOCON and the flag of the bank are written as zero, which clears them. A
 * one leaves a flag as it is; but on an IN endpoint, a one in the bit of RXOUTI (there KILLBK) would take back the bank
 * just sent, so that bit is zero. */
#define RELEASE_IN (BIT(NAKOUTI) | BIT(RXSTPI) | BIT(STALLEDI) | BIT(RWAL))
#define RELEASE_OUT (BIT(NAKINI) | BIT(RXSTPI) | BIT(STALLEDI) | BIT(RWAL) | BIT(TXINI))

/* A bank is never filled completely: every packet is short, and the host delivers a short packet at once. */
#define PACKET_MAX (EP_SIZE - 1u)

#define RING_SIZE (USB_ROOM + 1u)

static volatile bool bus_was_reset, suspended;
static uint8_t suspends;
/* send buffer; empty when head == tail; above restart.c's memory */
static uint8_t ring[RING_SIZE] __attribute__((section(".noinit.ring")));
static uint16_t head, tail;     /* indices of the next byte to write and to send */

void usb_start(void)
{
	USBCON = 0; /* the bootloader may have left the controller on */
	UHWCON = BIT(UVREGE);
	USBCON = BIT(USBE) | BIT(FRZCLK);
	PLLCSR = BIT(PINDIV) | BIT(PLLE);
	for (uint16_t n = 0; n < PLL_TRIES && !(PLLCSR & BIT(PLOCK)); n++)
		;
	USBCON = BIT(USBE) | BIT(OTGPADE);
	UDIEN = BIT(EORSTE) | BIT(SUSPE);
	UDCON = 0; /* full speed, attached */
}

/* A bus without traffic for 3 ms is suspended. The controller's clock stays on, so that it answers at once when the bus
 * resumes. On a bus that stays idle the flag may come back at once: the interrupt is off until traffic does [Arduino's
 * USBCore.cpp]. */
ISR(USB_GEN_vect)
{
	uint8_t flags = UDINT;
	suspended = !(flags & BIT(EORSTI));
	if (!suspended)
		bus_was_reset = true;
	UDIEN = suspended ? BIT(EORSTE) : BIT(EORSTE) | BIT(SUSPE);
	UDINT = (uint8_t)~flags; /* what comes after the look stays flagged */
	board_awake = true;
}

/* Disables the interrupts of each endpoint that raised one. */
ISR(USB_COM_vect)
{
	uint8_t selected = UENUM, waiting = UEINT;
	for (uint8_t endpoint = 0; endpoint < EP_COUNT; endpoint++) {
		if (waiting & BIT(endpoint)) {
			UENUM = endpoint;
			UEIENX = 0;
		}
	}
	UENUM = selected;
	board_awake = true;
}

void usb_enable(uint8_t endpoint, uint8_t type, uint8_t memory)
{
	UENUM = endpoint;
	/* RSTDT: the first packet is DATA0, as the host expects after it has set a configuration */
	UECONX = BIT(RSTDT) | BIT(EPEN);
	UECFG0X = type;
	UECFG1X = memory;
}

static void reset_endpoints(uint8_t mask)
{
	UERST = mask;
	UERST = 0;
}

void usb_start_port(void)
{
	usb_enable(EP_NOTIFY, TYPE_INTERRUPT_IN, MEMORY_16);
	usb_enable(EP_OUT, TYPE_BULK_OUT, MEMORY_64_DOUBLE);
	usb_enable(EP_IN, TYPE_BULK_IN, MEMORY_64_DOUBLE);
	reset_endpoints(BIT(EP_NOTIFY) | BIT(EP_OUT) | BIT(EP_IN));
}

void usb_empty_port(void)
{
	tail = head;
	reset_endpoints(BIT(EP_IN));
}

static uint16_t ring_next(uint16_t index)
{
	return (uint16_t)((index + 1u) & (RING_SIZE - 1u));
}

static uint16_t ring_room(void)
{
	return (uint16_t)((tail - head - 1u) & (RING_SIZE - 1u));
}

bool usb_write(const uint8_t *bytes, uint8_t length)
{
	if (ring_room() < length)
		return false;
	while (length--) {
		ring[head] = *bytes++;
		head = ring_next(head);
	}
	return true;
}

static void send_packet(void)
{
	for (uint8_t n = 0; n < PACKET_MAX && tail != head; n++) {
		UEDATX = ring[tail];
		tail = ring_next(tail);
	}
	UEINTX = RELEASE_IN;
}

static void send_packets(void)
{
	UENUM = EP_IN;
	while (tail != head && (UEINTX & BIT(RWAL)))
		send_packet();
	UEIENX = tail != head ? BIT(TXINE) : 0;
}

static void enable_receive_interrupt(void)
{
	UENUM = EP_OUT;
	UEIENX = BIT(RXOUTE);
}

int16_t usb_read(void)
{
	if (!usb_control_is_configured())
		return -1;
	UENUM = EP_OUT;
	if (!(UEINTX & BIT(RXOUTI)))
		return -1;
	int16_t byte = (UEINTX & BIT(RWAL)) ? (int16_t)UEDATX : (int16_t)-1;
	if (!(UEINTX & BIT(RWAL)))
		UEINTX = RELEASE_OUT;
	return byte;
}

bool usb_is_open(void)
{
	return usb_control_is_configured() && usb_control_port_is_open() && !suspended;
}

/* A start of frame ends a suspension. A port that is not configured yet is suspended until the host resets the bus:
 * this does not count. */
static void follow_suspend(void)
{
	static bool counted;
	if (suspended && (UDINT & BIT(SOFI))) {
		suspended = false;
		UDINT = (uint8_t)~BIT(SUSPI); /* of the suspension that is over */
		UDIEN = BIT(EORSTE) | BIT(SUSPE);
	}
	if (suspended && !counted && usb_control_is_configured())
		suspends++;
	counted = suspended;
}

uint8_t usb_suspends(void)
{
	return suspends;
}

static bool cable_pulled(void)
{
	return !(USBSTA & BIT(VBUS));
}

void usb_run(void)
{
	if (bus_was_reset || cable_pulled()) {
		bus_was_reset = false;
		usb_control_start();
	}
	follow_suspend();
	usb_control_run();
	if (!usb_control_is_configured())
		return;
	enable_receive_interrupt();
	send_packets();
}
