/* SPDX-License-Identifier: GPL-3.0-or-later
 * The chips around the processor: what all of them have (kit.c), those with registers (registers.c), and rangers (rangers.c). */
#ifndef ECHOSTEP_TWIN_PARTS_H
#define ECHOSTEP_TWIN_PARTS_H

#include "twin.h"

enum place { PLACE_FOOT, PLACE_RANGER_LEFT, PLACE_RANGER_RIGHT, PLACE_COMPASS, PLACE_THIGH, PLACE_CALF, PLACE_BELT, PLACE_PRESSURE, PLACES };
enum kind { OF_PAPERS, OF_2026, MAXSONAR, OF_FOOT }; /* of a foot board, which has nothing in the other places */

/* The faults that a model's list begins with; on I2C it has all of these. */
enum { GOOD, ABSENT, OTHER_FAULTS, NACK = OTHER_FAULTS, STRETCH, OTHER_TWI_FAULTS };

/* One chip; the structs of all models begin with it. */
struct part {
	const struct model *model;
	const char *name; /* of its fault switch */
	enum place place;
	unsigned fault; /* which of its model's */
	struct part *next;
};
#define PART(of, switch_name, in) { .model = &(of), .name = (switch_name), .place = (in) }

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

/* A file of registers, of which a frame chooses one; then their addresses count up. */
struct register_file {
	union {
		struct part part;
		struct spi_device spi;
		struct twi_device twi;
	};
	uint8_t address; /* of the next byte */
	unsigned count;  /* bytes of the frame so far */
	bool reading, counts_up, garbled;
	avr_cycle_count_t up_at; /* it does not answer before */
};

/* A ranger on I2C. */
struct ranger {
	struct twi_device twi;
	struct bursts {
		struct burst {
			avr_cycle_count_t at;
			uint16_t cross_us; /* when it reaches the other ranger, 0: never */
		} last[4];
		unsigned count;
	} bursts;
	avr_cycle_count_t began, busy_until; /* of the newest ranging */
	bool listening;                      /* its result is not known yet */
	uint16_t own_us, result;             /* its own echo, 0: none; the last result */
	uint8_t written[3], count;           /* bytes of the write under way */
	uint8_t pointer;                     /* to what is read next */
	uint8_t unit, sequence;              /* of an SRF02 */
};

/* A kind of chip: what it is and does; NULL where it does nothing. */
struct model {
	enum kind kind;
	const char *faults; /* their names, with blanks between them */
	void *parts;        /* an array */
	size_t count, size;
	void (*wire)(struct part *self);                     /* once: to its bus and pins */
	void (*power)(struct part *self);                    /* it gets power */
	void (*resume)(struct part *self);                   /* the processor was reset: simavr has lost all timers */
	void (*changed)(struct part *self, unsigned before); /* it has another fault */

	void (*select)(struct spi_device *self, bool on);
	int (*exchange)(struct spi_device *self, uint8_t out); /* SPI_OPEN: it does not drive MISO */

	bool (*start)(struct twi_device *self, bool read);    /* acknowledge? */
	bool (*write)(struct twi_device *self, uint8_t byte); /* acknowledge? */
	uint8_t (*read)(struct twi_device *self);
	void (*stop)(struct twi_device *self);
	unsigned stretch_us, fault_stretch_us; /* always; with the fault STRETCH */

	int (*get)(struct register_file *self, uint8_t at);
	void (*set)(struct register_file *self, uint8_t at, uint8_t value);
	unsigned rise_ns;     /* of the level shifter of its clock */
	unsigned zeros;       /* the fault that holds MISO low; 0: none */
	unsigned dummy_bytes; /* before the first that is read */
	uint8_t address_mask; /* on I2C; the bit 0x80, where it is none of an address, makes these count up */

	uint16_t (*result_of)(const struct ranger *self, uint32_t us); /* of a time of flight; 0: no echo */
	uint32_t least_us, window_us;                                  /* first and last time at which it hears an echo */
};
#define PARTS(array) .parts = (array), .count = sizeof(array) / sizeof *(array), .size = sizeof *(array)

extern const struct model srf02, adis16100, scp1000, compass, bmp390, lis3mdl, lsm6dso, pulse, maxsonar, icm20649;

/* kit.c */
bool place_has(enum place place, enum kind kind);
bool part_is_plugged(const struct part *part);
bool part_is_here(const struct part *part); /* and not absent by its fault */
unsigned parts_here(const struct model *model);
void part_returned(struct part *part, unsigned before); /* `changed` of a part that loses its settings while it is absent */

/* spi.c */
void spi_wire(struct part *part);
unsigned spi_hertz(void);
unsigned spi_mode(void);
uint8_t spi_at_rising_edges(uint8_t out); /* what a part of modes 0 and 3 reads of a byte */
int spi_answer(int answer);               /* what the processor reads of such a part's byte */
bool spi_outruns(unsigned rise_ns);       /* half a bit is shorter than a level shifter's rise */
bool spi_garbles(const char *chip, unsigned most_hertz, bool right_mode); /* all bits arrive one bit late; the trace names the cause */

/* twi.c */
void twi_wire(struct part *part);

/* registers.c: the frames of SPI modes 0 and 3, and those of I2C */
void registers_select(struct spi_device *self, bool on);
bool registers_answer(const struct register_file *f); /* on SPI */
int registers_exchange(struct spi_device *self, uint8_t sent);
bool registers_start(struct twi_device *self, bool read);
bool registers_write(struct twi_device *self, uint8_t byte);
uint8_t registers_read(struct twi_device *self);

/* rangers.c */
enum { MUTE = OTHER_TWI_FAULTS, DEAF, MISREADS };
void bursts_add(struct bursts *own, avr_cycle_count_t at, uint16_t cross_us);
/* The first echo after `began`, from `least_us` on and within the window, in us: of the own burst, or of the other ranger's; 0: none. */
uint32_t bursts_first_echo(const struct bursts *others, avr_cycle_count_t began, uint16_t own_us, uint32_t least_us, uint32_t window_us);
unsigned ranger_side(const struct part *part); /* 0 left, 1 right */
void ranger_power(struct part *part);
bool ranger_start(struct twi_device *self, bool read);
bool ranger_write(struct twi_device *self, uint8_t byte);
void ranger_begin(struct ranger *r, bool burst);
void ranger_listen(struct ranger *r, uint16_t own_us, avr_cycle_count_t until);

#endif
