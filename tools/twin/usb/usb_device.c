/* SPDX-License-Identifier: GPL-3.0-or-later
 * USB device controller of the ATmega32U4 [data sheet, chapters 21 and 22]: its registers; the cable's side is in
 * usb_transactions.c.
 *
 * Endpoints with two banks. Interrupts depend on levels, as in the chip: they are computed on every access and after
 * every interrupt. */
#include <string.h>

#include <simavr/sim_cycle_timers.h>
#include <simavr/sim_interrupts.h>

#include "usb/usb_endpoints.h"

#define VECTOR_GENERAL 10
#define VECTOR_ENDPOINT 11

struct endpoint usb_endpoints[ENDPOINTS];
static bool suspended; /* the bus is idle */
FAULT_SWITCH(late_reset, "off on", NULL, 0)
/* while the bus is idle the flag comes back at once: unknown of the silicon */
FAULT_SWITCH(suspend_repeats, "off on", NULL, 0)

static struct endpoint *selected(void) { return &usb_endpoints[avr->data[UENUM] < ENDPOINTS ? avr->data[UENUM] : 0]; }
static struct bank *bank_of_cpu(struct endpoint *e) { return &e->bank[is_control(e) ? 0 : e->cpu]; }

static uint8_t interrupts_of(struct endpoint *e)
{
	const struct bank *b = &e->bank[e->cpu];
	uint8_t flags = e->flags & (uint8_t)~RWAL;

	if (is_control(e) || !(flags & FIFOCON))
		return flags;
	if (is_in(e) ? b->length < size_of(e) : b->read < b->length)
		flags |= RWAL;
	return flags;
}

static void set_level(int number, bool level)
{
	avr_int_vector_t *v = vector(number);

	if (level && !v->pending)
		avr_raise_interrupt(avr, v);
	else if (!level && v->pending)
		avr_clear_interrupt(avr, v);
}

void usb_refresh(void)
{
	uint8_t raised = 0;

	for (int i = 0; i < ENDPOINTS; i++)
		if (interrupts_of(&usb_endpoints[i]) & usb_endpoints[i].enabled & (uint8_t)~RWAL)
			raised |= (uint8_t)(1 << i);
	avr->data[UEINT] = raised;
	bool bus = avr->data[UDINT] & avr->data[UDIEN] & 0x7D;
	bool vbus = (avr->data[USBINT] & VBUSTI) && (avr->data[USBCON] & VBUSTE);
	set_level(VECTOR_GENERAL, bus || vbus);
	set_level(VECTOR_ENDPOINT, raised != 0);
}

void usb_offer_bank(struct endpoint *e)
{
	const struct bank *b = &e->bank[e->cpu];

	if (is_in(e) && !b->full)
		e->flags |= TXINI | FIFOCON;
	else if (!is_in(e) && b->full)
		e->flags |= RXOUTI | FIFOCON;
}

static avr_cycle_count_t reset_late(avr_t *a, avr_cycle_count_t when, void *param)
{
	late_reset.value = 0;
	usb_host_reset();
	return 0;
}

/* With the fault `late_reset` a suspended bus is reset right after the program has looked. */
static uint8_t look_at_bus(void)
{
	if (late_reset.value && (avr->data[UDINT] & USB_SUSPEND))
		avr_cycle_timer_register(avr, 1, reset_late, NULL);
	return avr->data[UDINT];
}

static uint8_t read_register(avr_t *a, avr_io_addr_t address, void *param)
{
	struct endpoint *e = selected();
	struct bank *b = bank_of_cpu(e);

	switch (address) {
	case UDINT: return look_at_bus();
	case UEINTX: return interrupts_of(e);
	case UECONX: return (uint8_t)((e->conx & EPEN) | (e->stalled ? STALLRQ : 0));
	case UECFG0X: return e->cfg0;
	case UECFG1X: return e->cfg1;
	case UEIENX: return e->enabled;
	case UESTA0X: return (uint8_t)((e->cfg1 & ALLOC ? 0x80 : 0) | (e->bank[0].full + e->bank[1].full));
	case UEDATX: return b->read < b->length ? b->bytes[b->read++] : 0;
	case UEBCLX: return (uint8_t)(is_in(e) && !is_control(e) ? b->length : b->length - b->read);
	default: return avr->data[address];
	}
}

static void write_byte(struct endpoint *e, uint8_t value)
{
	struct bank *b = is_control(e) ? &e->bank[1] : &e->bank[e->cpu];

	if (b->length < size_of(e))
		b->bytes[b->length++] = value;
}

static void clear_control_flags(struct endpoint *e, uint8_t cleared)
{
	if (cleared & RXSTPI) {
		memset(e->bank, 0, sizeof e->bank);
		e->flags |= TXINI;
	} else if (cleared & TXINI) {
		e->bank[1].full = true;
	}
	if (cleared & RXOUTI) {
		e->bank[0].length = e->bank[0].read = 0;
		e->bank[0].full = false;
	}
}

static void hand_over(struct endpoint *e)
{
	struct bank *b = &e->bank[e->cpu];

	e->flags &= (uint8_t)~(is_in(e) ? TXINI : RXOUTI);
	b->full = is_in(e);
	if (!is_in(e))
		b->length = b->read = 0;
	e->cpu = (e->cpu + 1) % banks_of(e);
	usb_offer_bank(e);
}

/* UEINTX: bits written as zero are cleared; some of them hand over a bank. */
static void clear_flags(struct endpoint *e, uint8_t cleared)
{
	e->flags &= (uint8_t)~cleared;
	if (is_control(e))
		clear_control_flags(e, cleared);
	else if (cleared & FIFOCON)
		hand_over(e);
}

/* On an IN endpoint, a one in the bit of RXOUTI is KILLBK: it takes back the bank that was handed over last. */
static void kill_bank(struct endpoint *e)
{
	int last = (e->cpu + banks_of(e) - 1) % banks_of(e);

	if (!e->bank[last].full)
		return;
	e->bank[last].full = false;
	e->bank[last].length = 0;
	e->cpu = last;
	usb_offer_bank(e);
}

static void reset_fifo(struct endpoint *e)
{
	memset(e->bank, 0, sizeof e->bank);
	e->cpu = e->cable = 0;
	e->flags = 0;
	if (is_control(e))
		e->flags = TXINI;
	else
		usb_offer_bank(e);
}

/* Registers of the whole device. */
static void write_device_register(avr_io_addr_t address, uint8_t value)
{
	uint8_t old = avr->data[address];

	switch (address) {
	case USBCON:
		if ((value & OTGPADE) && !(old & OTGPADE)) {
			avr->data[USBSTA] |= VBUS;
			avr->data[USBINT] |= VBUSTI;
		}
		if (!(value & USBE))
			memset(usb_endpoints, 0, sizeof usb_endpoints);
		break;
	case USBINT:
	case UDINT:
		value &= old;
		if (address == UDINT && suspend_repeats.value && suspended)
			value |= USB_SUSPEND;
		break;
	case UENUM: value &= 7; break;
	case UERST:
		for (int i = 1; i < ENDPOINTS; i++)
			if ((old & ~value) & (1 << i))
				reset_fifo(&usb_endpoints[i]);
		break;
	case UDADDR:
		if ((value & ADDEN) && !(old & ADDEN) && ((value ^ old) & 0x7F)) {
			bench_trace("usb: address and its enable bit written at once");
			value &= 0x7F;
		}
		break;
	case UEINT:
	case UDFNUML:
	case UDFNUMH: return; /* read only */
	}
	avr->data[address] = value;
}

/* Registers of the selected endpoint, and those of the whole device. */
static void write_register(avr_t *a, avr_io_addr_t address, uint8_t value, void *param)
{
	struct endpoint *e = selected();

	switch (address) {
	case UECONX:
		e->conx = value & EPEN;
		e->stalled = !(value & STALLRQC) && (e->stalled || (value & STALLRQ));
		e->toggle = e->toggle && !(value & RSTDT);
		break;
	case UECFG0X: e->cfg0 = value; break;
	case UECFG1X:
		e->cfg1 = value;
		if (value & ALLOC)
			reset_fifo(e);
		break;
	case UEIENX: e->enabled = value; break;
	case UEDATX: write_byte(e, value); break;
	case UEINTX:
		if (is_in(e) && !is_control(e) && (value & RXOUTI))
			kill_bank(e);
		clear_flags(e, (uint8_t)(e->flags & ~value));
		break;
	case UEBCLX:
	case UEBCHX:
	case UESTA0X:
	case UESTA1X: break; /* read only */
	default: write_device_register(address, value);
	}
	usb_refresh();
}

static void after_interrupt(struct avr_irq_t *irq, uint32_t running, void *param)
{
	if (!running)
		usb_refresh();
}

void usb_device_init(void)
{
	for (avr_io_addr_t a = UHWCON; a <= UEINT; a++)
		take_register(a, read_register, write_register);
	for (int v = VECTOR_GENERAL; v <= VECTOR_ENDPOINT; v++)
		avr_irq_register_notify(vector(v)->irq + AVR_INT_IRQ_RUNNING, after_interrupt, NULL);
}

void usb_device_reset(void)
{
	memset(usb_endpoints, 0, sizeof usb_endpoints);
	avr->data[UDCON] = DETACH;
	avr->data[USBCON] = FRZCLK;
}

bool usb_device_attached(void)
{
	bool running = (avr->data[USBCON] & (USBE | FRZCLK)) == USBE && (avr->data[PLLCSR] & PLOCK);

	return running && (avr->data[UHWCON] & UVREGE) && !(avr->data[UDCON] & DETACH);
}

void usb_bus_event(enum usb_event event, uint16_t frame)
{
	suspended = event == USB_SUSPEND || (suspended && event != USB_RESET && event != USB_FRAME && event != USB_RESUME);
	if (event == USB_RESET) {
		memset(usb_endpoints, 0, sizeof usb_endpoints);
		avr->data[UDADDR] = 0;
	}
	if (event == USB_FRAME) {
		avr->data[UDFNUML] = (uint8_t)frame;
		avr->data[UDFNUMH] = (frame >> 8) & 7;
	}
	avr->data[UDINT] |= (uint8_t)event;
	usb_refresh();
}
