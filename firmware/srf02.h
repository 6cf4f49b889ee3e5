/* SPDX-License-Identifier: MIT */
/* Devantech SRF02, an ultrasonic ranger on I2C: left at address 0x70, right at 0x71. */
#ifndef ECHOSTEP_SRF02_H
#define ECHOSTEP_SRF02_H

#include "ranger.h" /* struct ranging */

/* Sends the ranging command; false: the bus is in use. */
bool srf02_begin(uint8_t side, struct ranging *r);

/* Does the next step. RANGING_REFUSED: no answer, or that of another part. */
enum ranging_state srf02_run(uint8_t side, uint32_t now, struct ranging *r);

#endif
