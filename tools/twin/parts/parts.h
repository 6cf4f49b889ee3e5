/* SPDX-License-Identifier: GPL-3.0-or-later
 * The chips around the processor: what all of them have (kit.c), those with registers (registers.c), and rangers
 * (rangers.c). */
#ifndef ECHOSTEP_TWIN_PARTS_H
#define ECHOSTEP_TWIN_PARTS_H

#include "twin.h"

enum place {
	PLACE_FOOT, PLACE_RANGER_LEFT, PLACE_RANGER_RIGHT, PLACE_COMPASS, PLACE_THIGH, PLACE_CALF, PLACE_BELT,
	PLACE_PRESSURE, PLACES,
};
enum kind { OF_PAPERS, OF_2026, MAXSONAR, OF_FOOT }; /* of a foot board, which has nothing in the other places */

/* The faults that a model's list begins with; on I2C it has all of these. */
enum { GOOD, ABSENT, OTHER_FAULTS, NACK = OTHER_FAULTS, STRETCH, OTHER_TWI_FAULTS };

/* One chip; the structs of all models begin with it. */
struct part {
	struct fault_switch fault;
	const struct model *model;
	enum place place;
	avr_cycle_count_t sample_at; /* its next measurement; 0: none */
	struct part *next;
};
#define PART(of, in, switch_name) { .model = &(of), .place = (in), .fault.name = (switch_name) }

struct spi_device {
	struct part part;
	char port;
	uint8_t pin; /* chip select, active low */
	bool selected;
	struct spi_device *next;
};
#define SPI_OPEN (-1)

struct twi_device {
	struct part part;
	uint8_t address;  /* 7-bit */
	uint32_t stretch; /* cycles for which it holds the clock low after each byte of the transfer under way */
	struct twi_device *next;
};

/* A file of registers: the first byte of a frame has the address, and the addresses of the bytes that follow count
 * up. */
struct register_file {
	union {
		struct part part;
		struct spi_device spi;
		struct twi_device twi;
	};
	uint8_t address; /* of the next byte */
	unsigned count;  /* bytes of the frame so far, on SPI */
	bool reading, counts_up, garbled;
	avr_cycle_count_t up_at; /* it does not answer before */
};

/* The last bursts of a ranger, for the other one hears them too. */
struct bursts {
	struct burst {
		avr_cycle_count_t at;
		uint16_t cross_us; /* when it reaches the other ranger, 0: never */
		uint32_t late_us;  /* the same of its last reverberation */
	} last[4];
	unsigned count;
};

/* A ranger on I2C. */
struct ranger {
	struct twi_device twi;
	struct bursts bursts;
	avr_cycle_count_t began, busy_until; /* of the newest ranging */
	bool listening;                      /* its result is not known yet */
	uint16_t own_us;                     /* its own echo; 0: none */
	uint32_t result_us;                  /* of the last ranging that has ended */
	uint8_t written[2], count;           /* bytes of the write under way */
	uint8_t pointer;                     /* to what is read next */
};

/* A kind of chip: what it is and does; NULL where it does nothing. */
struct model {
	enum kind kind;
	const char *faults; /* their names, with blanks between them */
	void *parts;        /* an array */
	size_t count, size;
	void (*wire)(void *self);   /* once: to pins */
	void (*power)(void *self);  /* it gets power */
	void (*resume)(void *self); /* the processor was reset: simavr has lost all timers but those of `sample` */
	void (*changed)(void *self, unsigned before); /* it has another fault */
	avr_cycle_count_t (*sample)(void *self);      /* it measures; returns the time to the next measurement, 0: none */

	void (*select)(void *self, bool on);         /* on SPI */
	int (*exchange)(void *self, uint8_t out);    /* SPI_OPEN: it does not drive MISO */
	void (*overhear)(void *self);                /* a byte for another part */

	bool (*start)(void *self, bool read);               /* on I2C: acknowledge? */
	bool (*write)(void *self, uint8_t byte, bool first); /* acknowledge? */
	uint8_t (*read)(void *self);
	void (*stop)(void *self);
	unsigned stretch_us, fault_stretch_us; /* always; with the fault STRETCH */

	int (*get)(void *self, uint8_t at);      /* a register */
	void (*set)(void *self, uint8_t at, uint8_t value);
	unsigned rise_ns;     /* of the level shifter of its clock */
	unsigned zeros;       /* the fault that holds MISO low; 0: none */
	unsigned dummy_bytes; /* before the first that is read */
	uint8_t address_mask; /* on I2C; the bit 0x80, where it is none of an address, makes these count up */

	uint32_t least_us, window_us; /* first and last time at which a ranger hears an echo */
	uint32_t (*listens_us)(void); /* instead of window_us */
	uint32_t (*fades_us)(void);   /* when a burst's last reverberation reaches the other ranger; 0: never */
};
#define PARTS(array) .parts = (array), .count = sizeof(array) / sizeof *(array), .size = sizeof *(array)

extern const struct model srf02, adis16100, scp1000, compass, bmp390, lis3mdl, lsm6dso, pulse, maxsonar, icm20649;

/* kit.c */
bool place_has(enum place place, enum kind kind);
bool part_is_plugged(const struct part *part);
bool part_is_here(const struct part *part); /* and not absent by its fault */
unsigned parts_here(const struct model *model);
void part_sample_after(void *self, avr_cycle_count_t cycles); /* its next measurement; 0: none */
void part_returned(void *self, unsigned before); /* `changed` of a part that loses its settings while it is absent */

/* spi.c, twi.c */
void spi_add(struct spi_device *device);
unsigned spi_mode(void);
uint8_t spi_at_rising_edges(uint8_t out); /* what a part of modes 0 and 3 reads of a byte */
int spi_answer(int answer);               /* what the processor reads of such a part's byte */
bool spi_outruns(unsigned rise_ns);       /* half a bit is shorter than a level shifter's rise */
/* all bits arrive one bit late; the trace names the cause */
bool spi_garbles(const char *chip, unsigned most_hertz, bool right_mode);
void twi_add(struct twi_device *device);

/* registers.c: the frames of SPI modes 0 and 3, and those of I2C */
void registers_select(void *self, bool on);
bool registers_answer(const struct register_file *f); /* on SPI */
int registers_exchange(void *self, uint8_t sent);
bool registers_write(void *self, uint8_t byte, bool first);
uint8_t registers_read(void *self);

/* rangers.c */
enum { MUTE = OTHER_TWI_FAULTS, DEAF, MISREADS };
extern const char *const sides[2];
/* The first echo after `began` within the model's window, in us: of the own burst, or of the other ranger's; 0:
 * none. */
uint32_t bursts_first_echo(const struct model *model, const struct bursts *others,
                           avr_cycle_count_t began, uint16_t own_us);
void bursts_add(const struct model *model, struct bursts *own, unsigned side, avr_cycle_count_t at); /* and traces it */
void ranger_power(void *self);
bool ranger_start(void *self, bool read);
bool ranger_write(void *self, uint8_t byte, bool first);
void ranger_ping(struct ranger *r, avr_cycle_count_t busy_until);

#endif
