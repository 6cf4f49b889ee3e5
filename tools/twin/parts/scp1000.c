/* SPDX-License-Identifier: GPL-3.0-or-later
 * SCP1000-D01 barometer on SPI [SCP1000 product family specification]: mode 0, at most 500 kHz, frames of address << 2
 * | write << 1.
 *
 * After power-up it is busy for 60 ms; OPERATION 0x09 measures at 9 Hz, 0x0A at 1.8 Hz; DRDY rises with each sample and
 * falls when DATARD16 is read. Writing 1 to RSTR restarts it. DRDY is wired to PE6. */
#include "parts/parts.h"

enum { NO_EEPROM = OTHER_FAULTS, NO_START, DRDY_STUCK, DRDY_LOW, ZEROS };
enum { FAST_MODE = 0x09, SLOW_MODE };
enum { REVISION = 0x00, OPERATION = 0x03, RSTR = 0x06, STATUS = 0x07, DATARD8 = 0x1F, DATARD16 = 0x20, TEMPOUT = 0x21 };
#define MAX_HERTZ 500000u
#define START_UP US(60000)
#define REVISION_D01 0x03
#define FAST US(111000)
#define SLOW US(556000)

static struct spi_device chips[] = { { .part = PART(scp1000, PLACE_PRESSURE, "scp1000"), .port = 'D', .pin = 7 } };
static bool ready, garbled;
static uint8_t command, count, answer[2], mode;
static avr_cycle_count_t up_at;
static uint32_t pressure;
static int16_t temperature;

static unsigned fault(void)
{
	return chips->part.fault.value;
}

static void set_ready(bool on)
{
	bool shown = part_is_here(&chips->part) && fault() != DRDY_LOW && fault() != ZEROS;

	ready = on;
	drive_pin('E', 6, shown && (on || fault() == DRDY_STUCK));
}

static avr_cycle_count_t period(void)
{
	return mode == SLOW_MODE ? SLOW : FAST;
}

static avr_cycle_count_t sample(void *self)
{
	if (mode != FAST_MODE && mode != SLOW_MODE)
		return 0;
	pressure = mode == FAST_MODE ? input.row.pressure & ~15u : input.row.pressure & ~3u; /* 15 and 17 bits of the 19 */
	temperature = input.row.temperature;
	set_ready(true);
	return period();
}

static void load(uint8_t address)
{
	uint16_t word = 0;

	switch (address) {
	case REVISION: word = REVISION_D01 << 8; break;
	case STATUS: word = avr->cycle < up_at || fault() == NO_START ? 0x0100 : ready ? 0x2000 : 0; break;
	case DATARD8: word = (uint16_t)(mode ? (pressure >> 16) << 8 : fault() == NO_EEPROM ? 0 : 0x0100); break;
	case DATARD16:
		word = (uint16_t)pressure;
		set_ready(false);
		break;
	case TEMPOUT: word = (uint16_t)temperature & 0x3FFF; break;
	default: break;
	}
	answer[0] = (uint8_t)(word >> 8);
	answer[1] = (uint8_t)word;
}

static void on_select(void *self, bool on)
{
	count = 0;
	if (on && part_is_plugged(self))
		garbled = spi_garbles("scp1000", MAX_HERTZ, spi_mode() == 0);
}

static void power(void *self)
{
	mode = 0;
	up_at = avr->cycle + START_UP;
	part_sample_after(self, 0);
	set_ready(false);
}

static int on_exchange(void *self, uint8_t sent)
{
	uint8_t out = sent >> garbled;

	if (!part_is_here(&chips->part))
		return SPI_OPEN;
	if (fault() == ZEROS)
		return 0;
	if (count++ == 0) {
		command = out;
		if (!(command & 2))
			load(command >> 2);
		return 0;
	}
	if (command & 2) {
		if (command >> 2 == RSTR && out == 1) {
			power(self);
		} else if (command >> 2 == OPERATION && out != mode) {
			mode = out;
			part_sample_after(self, period());
		}
		return 0;
	}
	return count <= 3 ? answer[count - 2] >> garbled : 0;
}

static void resume(void *self)
{
	bool level = ready;

	set_ready(false);
	set_ready(level);
}

static void changed(void *self, unsigned before)
{
	set_ready(ready);
}

const struct model scp1000 = {
	.kind = OF_PAPERS,
	.faults = "ok absent no_eeprom no_start drdy_stuck drdy_low zeros",
	PARTS(chips),
	.power = power,
	.resume = resume,
	.changed = changed,
	.sample = sample,
	.select = on_select,
	.exchange = on_exchange,
};
