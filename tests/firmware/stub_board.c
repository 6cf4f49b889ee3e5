/* SPDX-License-Identifier: MIT */
/* A board without a processor's registers: all that board.h asks for and nothing measures, for linux_board.c and
 * fuzz_firmware.c, which have the rest. */
#include "stub_board.h"

static struct restart known = { .cause = RESET_CAUSE_POWER_ON, .starts = 1 };

enum twi_state twi_state(const struct twi_transfer *transfer) { return (enum twi_state)transfer->state; }

uint8_t spi_exchange(uint8_t out) { (void)out; return stub_input(); }
uint8_t spi_begin(enum chip chip, enum spi_protocol protocol, uint8_t first)
{
	(void)chip, (void)protocol;
	return spi_exchange(first);
}
void spi_release(void) {}
void spi_write(enum chip chip, enum spi_protocol protocol, uint8_t address, uint8_t value)
{
	(void)chip, (void)protocol, (void)address, (void)value;
}
bool spi_pressure_ready(void) { return stub_input() & 1; }
void spi_excite_gyros(enum excitation excitation) { (void)excitation; }

bool usb_bootloader_wanted(void) { return false; }
void usb_name_foot(void) {}
uint8_t usb_suspends(void) { return 0; }

bool capture_trigger(uint8_t side) { (void)side; return stub_input() & 1; }
bool capture_pull_low(uint8_t side) { (void)side; return stub_input() & 1; }
void capture_end_pulse(uint8_t side) { (void)side; }
enum capture_state capture_take_pulse(uint8_t side, struct capture_pulse *out)
{
	uint8_t how = stub_input();
	uint32_t now = clock_now();
	(void)side;
	*out = (struct capture_pulse){ now - ((uint32_t)how << 8), now };
	return (enum capture_state)(how % 3);
}

uint8_t levels_read(void) { return stub_input(); }
const struct restart *restart_known(void) { return &known; }
void restart_enter(uint8_t place) { (void)place; }
void restart_note_sag(bool sagging) { (void)sagging; }
void board_lamp(bool level) { (void)level; }
void board_take_timing(uint16_t *turn, uint16_t *latency) { *turn = *latency = 0; }
uint16_t board_memory_used(void) { return 0; }
