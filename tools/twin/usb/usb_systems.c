/* SPDX-License-Identifier: GPL-3.0-or-later
 * The requests with which Linux, Windows and macOS enumerate a CDC-ACM port, in their order. */
#include "twin.h"

/* of the device descriptor, for the size of control packets */
#define DEVICE_START(length) { 0x80, 6, 0, 1, 0, 0, length, 0 }
#define ADDRESS_7 { 0x00, 5, 7, 0, 0, 0, 0, 0 }
#define DEVICE { 0x80, 6, 0, 1, 0, 0, 18, 0 }
#define CONFIGURATION(length) { 0x80, 6, 0, 2, 0, 0, length, 0 }
#define STRING(index, language, length) { 0x80, 6, index, 3, language, (language) ? 4 : 0, length, 0 }
#define QUALIFIER { 0x80, 6, 0, 6, 0, 0, 10, 0 } /* a full-speed device stalls */
#define CONFIGURATION_1 { 0x00, 9, 1, 0, 0, 0, 0, 0 }
#define RATE_115200 { 0x21, 0x20, 0, 0, 0, 0, 7, 0, 0x00, 0xC2, 0x01, 0x00, 0, 0, 8 }
#define GET_RATE { 0xA1, 0x21, 0, 0, 0, 0, 7, 0 }
#define DTR_OFF { 0x21, 0x22, 0, 0, 0, 0, 0, 0 }
#define GET_STATUS { 0x80, 0, 0, 0, 0, 0, 2, 0 }
#define BUS_RESET { USB_STEP_BUS_RESET } /* no request */
#define END { USB_STEPS_END }

/* In which order systems ask: Linux as its source has it, Windows [Microsoft, USB device enumeration], macOS from
 * memory. */
static const uint8_t scripts[][24][16] = {
	{ DEVICE_START(8), ADDRESS_7, DEVICE, CONFIGURATION(9), CONFIGURATION(255), STRING(0, 0, 255), STRING(2, 9, 255),
	  STRING(3, 9, 255), QUALIFIER, CONFIGURATION_1, STRING(4, 9, 255), RATE_115200, END },
	{ DEVICE_START(64), BUS_RESET, ADDRESS_7, DEVICE, CONFIGURATION(255), STRING(3, 9, 255), STRING(0, 0, 255),
	  STRING(2, 9, 255), QUALIFIER, STRING(0xEE, 0, 18), DEVICE, CONFIGURATION(9), CONFIGURATION(67), GET_STATUS,
	  CONFIGURATION_1, GET_RATE, DTR_OFF, RATE_115200, GET_RATE, END },
	{ DEVICE_START(8), ADDRESS_7, DEVICE, STRING(0, 0, 2), STRING(0, 0, 4), STRING(2, 9, 2), STRING(2, 9, 26),
	  STRING(1, 9, 2), STRING(1, 9, 18), STRING(3, 9, 2), STRING(3, 9, 42), CONFIGURATION(9), CONFIGURATION(67),
	  CONFIGURATION_1, { 0x01, 11, 0, 0, 1, 0, 0, 0 }, GET_RATE, RATE_115200, DTR_OFF, END },
};
FAULT_SWITCH(host_system, "linux windows macos", NULL, 0)

const uint8_t *usb_system_step(unsigned step)
{
	return scripts[host_system.value][step];
}
