/* SPDX-License-Identifier: GPL-3.0-or-later
 * The twin: an unmodified ATmega32U4 ELF in simavr, with models of buses, devices and a USB host.
 *
 * simavr's own USB, TWI and SPI are replaced, through its public tables, by models with true timing: usb_device.c, twi.c, spi.c.
 * Everything happens in simulated time; equal input gives equal output. */
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

/* The same millisecond for parts of three and more axes, in the axes that are printed on them. */
struct axes {
	int16_t rate[3];  /* LSM6DSO counts: 0.035 deg/s; in the first place of a foot board: 1/8.2 deg/s */
	int16_t force[3]; /* 0.244 mg; 1/1024 g */
} __attribute__((packed));

struct extended_row {
	struct row row;
	struct axes motion[3]; /* thigh, calf, belt */
	int16_t field[3];      /* at the belt: LIS3MDL counts, 6842 per gauss */
} __attribute__((packed));

#define ROW_SIZE sizeof(struct row)
#define NO_SYNC 65535u

extern avr_t *avr;
extern struct row row;       /* the millisecond under way */
extern struct axes motion[3];        /* of a foot board: those of the thigh are the foot's, in counts of an ICM-20649 */
extern struct axes motion_before[3]; /* of the millisecond before */
extern int16_t field[3];
extern uint64_t random_state; /* for everything that varies from part to part */

uint32_t random_below(uint32_t limit);
uint8_t disturbed(uint8_t byte, unsigned errors); /* with one wrong bit in so many of 1000 cases */
bool set_errors(unsigned *errors, const char *value);
void fail(const char *format, ...) __attribute__((noreturn, format(printf, 1, 2))); /* one line on stderr, exit status 2 */
avr_int_vector_t *vector(int number);

bool pin_is_output(char port, uint8_t pin);
bool pin_is_pulled_up(char port, uint8_t pin);

/* Sets the level that a chip drives onto a pin. Against an output of the processor: trace `contention on`. */
void drive_pin(char port, uint8_t pin, bool level);
bool pin_is_held(char port, uint8_t pin, bool level); /* a chip drives it to this level */
void release_pin(char port, uint8_t pin); /* no chip drives it: its pull-up, or a zero */

/* Replaces the functions that the program's reads and writes of a register call. */
void take_register(avr_io_addr_t address, avr_io_read_t read, avr_io_write_t write);

/* clock.c: true time; the processor's crystal may be off. */
uint64_t time_ns(void);                          /* simulated */
avr_cycle_count_t clock_next_millisecond(void);  /* begins one; returns its end */
avr_cycle_count_t clock_cycles(unsigned us);     /* of true time */
double clock_fraction(void);                     /* of the millisecond under way */
bool clock_fault(const char *value);

/* bench.c: the bytes that the board sends, and traces of its buses for tests. */
void bench_sent(const uint8_t *bytes, unsigned length);
bool bench_has_room(void); /* false: the program on the host does not read */
void bench_trace(const char *format, ...) __attribute__((format(printf, 1, 2)));
void bench_reset(void);
bool bench_swap(const char *value); /* false: there are no such sensors */
void bench_run(int in, int out);

/* usb_device.c, usb_transactions.c: the device controller, from the cable's side. */
enum usb_answer { USB_ACK = 0, USB_NAK = -1, USB_STALL = -2, USB_SILENCE = -3, USB_REPEATED = -4 };
void usb_device_init(void);
void usb_device_reset(void);
bool usb_device_attached(void);
void usb_bus_reset(void);
void usb_bus_suspend(void); /* 3 ms without traffic */
void usb_bus_resume(void);
void usb_target(uint8_t address); /* of the transactions that follow */
void usb_frame(uint16_t number);
int usb_setup(const uint8_t *request);
int usb_in(uint8_t endpoint, uint8_t *bytes, bool *toggle); /* returns the length, or a usb_answer; the packet stays until acknowledged */
void usb_in_acknowledged(uint8_t endpoint);
int usb_out(uint8_t endpoint, const uint8_t *bytes, unsigned length, bool toggle);

/* usb_cable.c: the same transactions as the host sees them. */
void usb_cable_reset_toggles(void); /* of the host, when it sets a configuration */
int usb_cable_setup(const uint8_t *request);
int usb_cable_in(uint8_t endpoint, uint8_t *bytes);
int usb_cable_out(uint8_t endpoint, const uint8_t *bytes, unsigned length);
bool usb_cable_errors(const char *value);

/* usb_systems.c: the requests of an operating system in its order; each step is a request, or begins with one of these: */
enum { USB_STEPS_END = 0xFE, USB_STEP_BUS_RESET = 0xFF };
const uint8_t *usb_system_step(unsigned step);
int usb_system_first_size(void);
bool usb_host_system(const char *value);

/* usb_hub.c: what a hub in between changes. */
unsigned usb_hub_debounce_ms(void);
unsigned usb_hub_frame(void);
void usb_hub_take(const uint8_t *bytes, unsigned length);
void usb_hub_clear(void);
bool usb_hub_fault(const char *value);

/* usb_host.c: enumerates the device, opens the port, moves bytes. */
void usb_host_start(void);   /* after power-up: registers its timer */
void usb_host_unplug(void);
void usb_host_reset(void);   /* a bus reset: the device is enumerated again */
void usb_host_suspend(bool on);
void usb_host_configure(void); /* sets the configuration that is in force again */
void usb_host_interface(void); /* selects the only setting of the data interface */
void usb_host_touch(bool twiggle);
void usb_host_stall(bool on); /* the program on the host does not read */
void usb_host_open(bool on);  /* a program has the port open (DTR) */
void usb_host_send(const uint8_t *bytes, unsigned length);

/* bursts.c: of one ranger, as the other one hears them. */
#define BURSTS 4
struct bursts {
	struct burst {
		avr_cycle_count_t at;
		uint16_t cross_us; /* when it reaches the other ranger, 0: never */
	} last[BURSTS];
	unsigned count;
};
void bursts_add(struct bursts *own, avr_cycle_count_t at, uint16_t cross_us);
/* The first echo after `began`, from `least_us` on and within the window, in us: of the own burst, or of the other ranger's; 0: none. */
uint32_t bursts_first_echo(const struct bursts *others, avr_cycle_count_t began, uint16_t own_us, uint32_t least_us, uint32_t window_us);

/* twi.c */
struct twi_device {
	uint8_t address;                                       /* 7-bit */
	bool (*start)(struct twi_device *self, bool read);     /* acknowledge? */
	bool (*write)(struct twi_device *self, uint8_t byte);  /* acknowledge? */
	uint8_t (*read)(struct twi_device *self);
	void (*stop)(struct twi_device *self);
	uint32_t stretch; /* cycles for which the device holds the clock low after each byte */
	struct twi_device *next;
};
enum twi_fault { TWI_GOOD, TWI_STUCK, TWI_STUCK_FOREVER, TWI_CLOCK_STUCK };
void twi_init(void);
void twi_reset(void);
void twi_add(struct twi_device *device);
void twi_fault(enum twi_fault fault);
bool twi_errors(const char *value);

/* spi.c */
#define SPI_OPEN (-1)
struct spi_device {
	char port;
	uint8_t pin; /* chip select, active low */
	void (*select)(struct spi_device *self, bool on);
	int (*exchange)(struct spi_device *self, uint8_t out); /* SPI_OPEN: it does not drive MISO */
	bool selected;
	struct spi_device *next;
};
void spi_init(void);
void spi_reset(void); /* the chip selects */
void spi_add(struct spi_device *device);
unsigned spi_hertz(void);
unsigned spi_mode(void);
uint8_t spi_at_rising_edges(uint8_t out); /* what a part of modes 0 and 3 reads of a byte */
int spi_answer(uint8_t answer);           /* what the processor reads of such a part's byte */
bool spi_errors(const char *value);
bool spi_outruns(unsigned rise_ns);       /* half a bit is shorter than a level shifter's rise */

/* miso.c: what the processor reads while no part drives MISO. */
uint8_t miso_idle(void);
void miso_millisecond(void);
bool miso_fault(const char *name, const char *value);

/* The devices: power-up (a reset of the processor is none), and fault switches `name=value` (false: no such switch). */
void srf02_power(void);
bool srf02_fault(const char *name, const char *value);
void adis16100_power(void);
void adis16100_resume(void); /* after a reset of the processor: its pins are inputs again */
bool adis16100_fault(const char *name, const char *value);
void scp1000_power(void);
void scp1000_resume(void); /* after a reset of the processor: simavr has lost the timers */
bool scp1000_fault(const char *name, const char *value);
void compass_power(void);
bool compass_fault(const char *name, const char *value);

void maxsonar_power(void);
bool maxsonar_fault(const char *name, const char *value);
void pulse_power(void);
void pulse_resume(void);
bool pulse_fault(const char *name, const char *value);
bool pulse_glitch(const char *value);
void lsm6dso_power(void);
unsigned lsm6dso_plugged(void); /* how many */
bool lsm6dso_fault(const char *name, const char *value);
void lis3mdl_power(void);
bool lis3mdl_fault(const char *name, const char *text);
void icm20649_power(void);
void icm20649_resume(void);
unsigned icm20649_plugged(void);
bool icm20649_fault(const char *name, const char *value);
void bmp390_power(void);
void bmp390_resume(void);
bool bmp390_plugged(void);
bool bmp390_fault(const char *name, const char *value);

/* kit.c: which part is in which place. */
enum place { PLACE_RANGER_LEFT, PLACE_RANGER_RIGHT, PLACE_COMPASS, PLACE_THIGH, PLACE_CALF, PLACE_BELT, PLACE_PRESSURE, PLACES };
bool kit_of_papers(enum place place);
bool kit_of_2026(enum place place);
bool kit_has_maxsonar(enum place place); /* a ranger */
bool kit_has_foot(void); /* a foot board, with nothing else */
bool kit_fault(const char *name, const char *value);

/* pty.c: the port as a pseudo terminal, which exists while the board is plugged in. */
void pty_open(void);
void pty_close(void);
bool pty_wanted(void);
bool pty_has_room(void);
void pty_write(const uint8_t *bytes, unsigned length);
void pty_poll(void);

/* board.c */
void board_init(void); /* the first power-up */
void board_power(bool on);
void board_reset(uint8_t cause); /* MCUSR bits */
bool has_series_resistor(char port, uint8_t pin); /* that keeps two outputs on its net apart */
bool board_runs(void);           /* once a millisecond: whether the program runs; without power, and in the bootloader, it does not */
void board_watchdog(void);
bool board_fault(const char *name, const char *value);

/* floating.c: the capture inputs while nothing drives them. */
void floating_pin(char port, uint8_t pin, bool open);
void floating_resume(void);
bool floating_hum(const char *value);

/* supply.c */
void supply_init(void);
bool supply_in_brown_out(void);
bool supply_is_unreliable(void);
bool supply_took_memory(void); /* since the last call */
bool supply_took_chips(void);  /* since the last call: the sensors lost their power */
bool supply_fault(const char *value);
bool supply_fuse(const char *value);

/* hang.c: a processor that hangs. */
void hang_now(void);
void hang_soon(void); /* at the next millisecond */
void hang_millisecond(void);
void hang_spi_selected(void);
void hang_end(void);
bool hang_fault(const char *value);

/* jtag.c */
void jtag_init(void);
void jtag_reset(void);
bool jtag_owns_analog_pins(void);
bool jtag_fault(const char *value);

/* signature.c */
void signature_init(void);

/* timer_flags.c */
void timer_flags_init(void);
void timer_flags_left_over(void);

/* watchdog.c */
void watchdog_init(void);

/* faults.c */
void switch_fault(char *text);

#endif
