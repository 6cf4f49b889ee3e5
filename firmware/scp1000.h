/* The SCP1000 barometer: starts it, keeps it running, one `pressure` message per sample. */
#ifndef ECHOSTEP_SCP1000_H
#define ECHOSTEP_SCP1000_H

#include <stdint.h>

/* Resets the chip and starts it in the configured mode; the first sample comes after about 0.2 s. */
void pressure_start(uint32_t now);

/* Takes the next step of the start, or a sample that is ready (0.3 ms); returns when to call again. */
uint32_t pressure_run(uint32_t now);

#endif
