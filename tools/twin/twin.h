/* SPDX-License-Identifier: GPL-3.0-or-later
 * The twin: an unmodified ATmega32U4 ELF in simavr, with models of buses, devices and a USB host.
 *
 * simavr's own USB, TWI and SPI are replaced, through its public tables, by models with true timing: usb_device.c,
 * twi.c, spi.c. Everything happens in simulated time; equal input gives equal output. */
#ifndef ECHOSTEP_TWIN_H
#define ECHOSTEP_TWIN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <simavr/sim_avr.h>

#define CYCLES_PER_MS 16000u
#define US(n) ((avr_cycle_count_t)(n) * 16u)

/* One millisecond of the sensors' input (host/docs/design/bench.md). */
struct row {
	int16_t rate[3]; /* thigh, calf, belt: ADIS16100 counts */
	uint16_t own_us[2];   /* left, right ranger: trigger to its own echo, 0: none */
	uint16_t cross_us[2]; /* trigger of the other ranger to its echo at this one, 0: none */
	uint16_t bearing;     /* 0.1 deg */
	uint32_t pressure;    /* 0.25 Pa */
	int16_t temperature;  /* 0.05 degC */
	uint16_t sync_us;     /* SyncOut edge within this millisecond, or NO_SYNC */
} __attribute__((packed));

/* For parts of three and more axes, in the axes that are printed on them. */
struct axes {
	int16_t rate[3];  /* LSM6DSO counts: 0.035 deg/s; in the first place of a foot board, an ICM-20649's: 1/8.2 deg/s */
	int16_t force[3]; /* 0.244 mg; 1/1024 g */
} __attribute__((packed));

struct extended_row {
	struct row row;
	struct axes motion[3]; /* thigh, calf, belt */
	int16_t field[3];      /* at the belt: LIS3MDL counts, 6842 per gauss */
} __attribute__((packed));

#define NO_SYNC 65535u

extern avr_t *avr;
extern struct extended_row input, previous; /* the millisecond under way, and the one before */
extern uint64_t random_state; /* for everything that varies from part to part */

uint32_t random_below(uint32_t limit);
uint8_t disturbed(uint8_t byte, unsigned errors); /* with one wrong bit in so many of 1000 cases */
/* one line on stderr, exit status 2 */
void fail(const char *format, ...) __attribute__((noreturn, format(printf, 1, 2)));
avr_int_vector_t *vector(int number);

bool pin_is_output(char port, uint8_t pin);
bool pin_is_low_output(char port, uint8_t pin);
bool pin_is_pulled_up(char port, uint8_t pin);
void set_pin(char port, uint8_t pin, bool level); /* of an input, as the program reads it */

/* Sets the level that a chip drives onto a pin. Against an output of the processor: trace `contention on`. */
void drive_pin(char port, uint8_t pin, bool level);
bool pin_is_held(char port, uint8_t pin, bool level); /* a chip drives it to this level */
void release_pin(char port, uint8_t pin); /* no chip drives it: its pull-up, or a zero */

/* Replaces the functions that the program's reads and writes of a register call. */
void take_register(avr_io_addr_t address, avr_io_read_t read, avr_io_write_t write);

/* faults.c: a switch `name=value` of the bench, which a model adds for itself. */
struct fault_switch {
	const char *name;
	const char *values; /* with blanks between them, or "<=" and the largest number */
	/* of this switch, or what begins with it; NULL: nothing else happens */
	void (*changed)(void *self, unsigned before);
	unsigned value;                               /* in force: which of the values, or the number */
	struct fault_switch *next;
};
void fault_switch_add(struct fault_switch *added);
void switch_fault(char *text);
#define FAULT_SWITCH(id, of, function, usual) \
	static struct fault_switch id = { .name = #id, .values = (of), .changed = (function), .value = (usual) }; \
	static void __attribute__((constructor)) add_##id(void) \
	{ \
		fault_switch_add(&id); \
	}

/* clock.c: true time; the processor's crystal may be off. */
uint64_t time_ns(void);                          /* simulated */
avr_cycle_count_t clock_next_millisecond(void);  /* begins one; returns its end */
avr_cycle_count_t clock_cycles(unsigned us);     /* of true time */
double clock_fraction(void);                     /* of the millisecond under way */

/* bench.c: the bytes that the board sends, and traces of its buses for tests. */
void bench_sent(const uint8_t *bytes, unsigned length);
void bench_trace(const char *format, ...) __attribute__((format(printf, 1, 2)));
void bench_sync(bool level);
void bench_init(void);
void bench_run(void);

/* usb_device.c: the device controller, from the cable's side. */
/* flags of UDINT; a bus is suspended after 3 ms without traffic */
enum usb_event { USB_SUSPEND = 1, USB_FRAME = 4, USB_RESET = 8, USB_RESUME = 16 };
void usb_device_init(void);
void usb_device_reset(void);
bool usb_device_attached(void);
void usb_bus_event(enum usb_event event, uint16_t frame);

/* usb_transactions.c: transactions as the host sees them. */
enum usb_answer { USB_ACK = 0, USB_NAK = -1, USB_STALL = -2, USB_SILENCE = -3, USB_REPEATED = -4 };
void usb_target(uint8_t address); /* of those that follow */
void usb_reset_toggles(void);     /* of the host, when it sets a configuration */
int usb_setup(const uint8_t *request);
int usb_in(uint8_t endpoint, uint8_t *bytes); /* returns the length, or a usb_answer */
int usb_out(uint8_t endpoint, const uint8_t *bytes, unsigned length);

/* usb_systems.c: the requests of an operating system in its order; each step is a request, or begins with one of
 * these: */
enum { USB_STEPS_END = 0xFE, USB_STEP_BUS_RESET = 0xFF };
const uint8_t *usb_system_step(unsigned step);

/* usb_hub.c: what a hub in between changes. */
unsigned usb_hub_debounce_ms(void);
unsigned usb_hub_frame(void);
void usb_hub_take(const uint8_t *bytes, unsigned length);
void usb_hub_clear(void);

/* usb_host.c: enumerates the device, opens the port, moves bytes. */
void usb_host_start(void);   /* after power-up: registers its timer */
void usb_host_unplug(void);
void usb_host_reset(void);   /* of the bus, after which it is enumerated again */
void usb_host_open(bool on); /* a program has the port open (DTR) */
void usb_host_send(const uint8_t *bytes, unsigned length);

/* pty.c: the port as a pseudo terminal, which exists while the board is plugged in. */
void pty_open(void);
void pty_close(void);
bool pty_wanted(void);
bool pty_has_room(void); /* false: the program on the host does not read */
void pty_write(const uint8_t *bytes, unsigned length);
void pty_poll(void);

/* twi.c, spi.c, kit.c: the buses and the chips on them. */
void twi_init(void);
void twi_reset(void);
void spi_init(void);
void spi_reset(void); /* the chip selects */
void parts_init(void);
void parts_power(void);
void parts_resume(void); /* after a reset of the processor, which is none of theirs: simavr has lost all timers */

/* miso.c: what the processor reads while no part drives MISO. */
uint8_t miso_idle(void);
void miso_millisecond(void);

/* board.c */
enum { POWER_ON = 1, EXTERNAL = 2, BROWN_OUT = 4, WATCHDOG = 8 }; /* causes of a reset: bits of MCUSR */
void board_init(void); /* the first power-up */
void board_power(bool on);
void board_reset(uint8_t cause);
bool has_series_resistor(char port, uint8_t pin); /* that keeps two outputs on its net apart */
/* once a millisecond: whether the program runs; without power, and in the bootloader, it does not */
bool board_runs(void);

/* floating.c: the capture inputs while nothing drives them. */
void floating_pin(char port, uint8_t pin, bool open);
void floating_resume(void);
void floating_millisecond(void);

/* hang.c: a processor that hangs. */
void hang_now(void);
void hang_soon(void); /* at the next millisecond */
void hang_millisecond(void);
void hang_spi_selected(void);
void hang_end(void);

/* chip.c, watchdog.c */
void chip_init(void);
void chip_reset(void);
bool jtag_owns_analog_pins(void);
void timer_flags_left_over(void);
void watchdog_init(void);

#endif
