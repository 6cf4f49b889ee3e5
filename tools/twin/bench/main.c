/* SPDX-License-Identifier: GPL-3.0-or-later
 * echostep-twin: runs the firmware's ELF on a simulated board; the bench protocol on standard input is the board's
 * input. */
#include <elf.h>
#include <getopt.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_interrupts.h>

#include "twin.h"

#define MCU "atmega32u4"
#define FREQUENCY 16000000u
#define EXTERNAL_INTERRUPTS 7
#define PORTS 5 /* B to F */

avr_t *avr;
uint64_t random_state = 1;

static elf_firmware_t firmware;

void fail(const char *format, ...)
{
	va_list arguments;

	fprintf(stderr, "echostep-twin: ");
	va_start(arguments, format);
	vfprintf(stderr, format, arguments);
	va_end(arguments);
	fprintf(stderr, "\n");
	_exit(2); /* without the rest of the output */
}

/* splitmix64 [Steele, Lea, Flood 2014] */
uint32_t random_below(uint32_t limit)
{
	uint64_t z = random_state += 0x9E3779B97F4A7C15ull;

	z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
	z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
	return (uint32_t)((z ^ (z >> 31)) % limit);
}

uint8_t disturbed(uint8_t byte, unsigned errors)
{
	return errors && random_below(1000) < errors ? byte ^ (uint8_t)(1u << random_below(8)) : byte;
}

avr_int_vector_t *vector(int number)
{
	for (int i = 0; i < avr->interrupts.vector_count; i++)
		if (avr->interrupts.vector[i]->vector == number)
			return avr->interrupts.vector[i];
	fail("this simavr has no interrupt vector %d", number);
}

/* Data direction and output registers of a port, which lie behind each other. */
static const uint8_t *port_registers(char port)
{
	return avr->data + 0x24 + 3 * (port - 'B');
}

bool pin_is_output(char port, uint8_t pin)
{
	return port_registers(port)[0] >> pin & 1;
}

bool pin_is_low_output(char port, uint8_t pin)
{
	return pin_is_output(port, pin) && !(port_registers(port)[1] >> pin & 1);
}

bool pin_is_pulled_up(char port, uint8_t pin)
{
	return !pin_is_output(port, pin) && (port_registers(port)[1] >> pin & 1);
}

/* Pins of the ports that chips drive, and their levels: simavr wants all of a port at once. */
static avr_ioport_external_t driven[PORTS];

void set_pin(char port, uint8_t pin, bool level)
{
	avr_raise_irq(avr_io_getirq(avr, (uint32_t)AVR_IOCTL_IOPORT_GETIRQ(port), pin), level);
}

/* The level is set in two ways: when the program writes to the port with the pull-up on, simavr keeps only an external
 * level. */
static void set_driven(char port, uint8_t pin, bool by_chip, bool level)
{
	avr_ioport_external_t *d = &driven[port - 'B'];
	unsigned bit = 1u << pin;

	d->name = (unsigned)port & 0x7Fu;
	d->mask = (by_chip ? d->mask | bit : d->mask & ~bit) & 0xFFu;
	d->value = (by_chip && level ? d->value | bit : d->value & ~bit) & 0xFFu;
	avr_ioctl(avr, (uint32_t)AVR_IOCTL_IOPORT_SET_EXTERNAL(port), d);
	if (!pin_is_output(port, pin))
		set_pin(port, pin, level);
}

/* A pin that the processor drives keeps the processor's level; two different ones are a short circuit through both. */
void drive_pin(char port, uint8_t pin, bool level)
{
	floating_pin(port, pin, false);
	set_driven(port, pin, true, level);
	if (pin_is_output(port, pin) && level != (port_registers(port)[1] >> pin & 1) && !has_series_resistor(port, pin))
		bench_trace("contention on P%c%u", port, pin);
}

bool pin_is_held(char port, uint8_t pin, bool level)
{
	return (driven[port - 'B'].mask >> pin & 1) && (driven[port - 'B'].value >> pin & 1) == level;
}

void release_pin(char port, uint8_t pin)
{
	set_driven(port, pin, false, pin_is_pulled_up(port, pin));
}

void take_register(avr_io_addr_t address, avr_io_read_t read, avr_io_write_t write)
{
	avr_io_addr_t io = AVR_DATA_TO_IO(address);

	if (read)
		avr->io[io].r.c = read;
	if (write)
		avr->io[io].w.c = write;
}

/* simavr's messages are not printed; errors are reported by `fail`. */
static void no_log(avr_t *a, const int level, const char *format, va_list arguments)
{
}

/* Simulated time jumps over a sleep. */
static void no_sleep(avr_t *a, avr_cycle_count_t cycles)
{
}

/* Entering an interrupt takes 4 cycles on the chip and none in simavr. */
static void add_entry_cycles(struct avr_irq_t *irq, uint32_t running, void *param)
{
	if (running)
		avr->cycle += 4;
}

/* Needed because simavr loads any file that it can open. */
static void check_elf(const char *path)
{
	Elf32_Ehdr head = { .e_machine = EM_NONE };
	FILE *file = fopen(path, "rb");

	if (!file)
		fail("%s: cannot read the firmware; build it with: make firmware", path);
	if (fread(&head, sizeof head, 1, file) != 1 || memcmp(head.e_ident, ELFMAG, SELFMAG) || head.e_machine != EM_AVR)
		fail("%s: not a program for an AVR", path);
	fclose(file);
}

static void make_board(const char *path)
{
	check_elf(path);
	if (elf_read_firmware(path, &firmware) || !firmware.flashsize)
		fail("%s: holds no program", path);
	avr = avr_make_mcu_by_name(MCU);
	if (!avr)
		fail("this simavr does not know the " MCU);
	avr_init(avr);
	avr_global_logger_set(no_log);
	if (firmware.flashsize > avr->flashend + 1)
		fail("%s: %u bytes do not fit into the flash", path, firmware.flashsize);
	avr_load_firmware(avr, &firmware);
	avr->frequency = FREQUENCY;
	avr->sleep = no_sleep;
	usb_device_init();
	twi_init();
	spi_init();
	watchdog_init();
	chip_init();
	for (int i = 0; i < avr->interrupts.vector_count; i++)
		avr_irq_register_notify(avr->interrupts.vector[i]->irq + AVR_INT_IRQ_RUNNING, add_entry_cycles, NULL);
	for (uint8_t i = 0; i < EXTERNAL_INTERRUPTS; i++)
		avr_extint_set_strict_lvl_trig(avr, i, 0); /* otherwise simavr polls low pins on every cycle */
	board_init();
}

static uint64_t seed_of(const char *text)
{
	char *end;
	uint64_t seed = strtoull(text, &end, 0);

	if (end == text || *end)
		fail("--seed %s: not a number", text);
	return seed;
}

int main(int argc, char **argv)
{
	static const struct option options[] = {
		{ "elf", required_argument, NULL, 'e' },
		{ "seed", required_argument, NULL, 's' },
		{ "fault", required_argument, NULL, 'f' },
		{ "pty", no_argument, NULL, 'p' },
		{ "help", no_argument, NULL, 'h' },
		{ NULL, 0, NULL, 0 },
	};
	const char *elf = NULL;
	bool with_pty = false;
	int option;

	while ((option = getopt_long(argc, argv, "", options, NULL)) != -1) {
		switch (option) {
		case 'e': elf = optarg; break;
		case 's': random_state = seed_of(optarg); break;
		case 'f': switch_fault(optarg); break; /* of constants: those that act at once need a board */
		case 'p': with_pty = true; break;
		case 'h':
			puts("echostep-twin --elf FILE [--seed N] [--fault NAME=VALUE] [--pty]");
			puts("The bench protocol on standard input and output; see README.md.");
			return 0;
		default: return 2;
		}
	}
	if (optind < argc)
		fail("'%s' is not an option; see --help", argv[optind]);
	if (!elf)
		fail("no firmware given: use --elf firmware/build/echostep.elf");
	signal(SIGPIPE, SIG_IGN);
	bench_init();
	usb_host_open(!with_pty);
	make_board(elf);
	if (with_pty)
		pty_open();
	bench_run();
	return 0;
}
