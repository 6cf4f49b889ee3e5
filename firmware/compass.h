/* The compass (Devantech CMPS03/CMPS10 class): `compass` messages at the configured rate. */
#ifndef ECHOSTEP_COMPASS_H
#define ECHOSTEP_COMPASS_H

#include <stdint.h>

/* Takes the configured rate; the first reading is due at once. */
void compass_start(uint32_t now);

/* Reads when it is due and no ranger is about to fire; returns when to call again, unless an interrupt calls earlier. */
uint32_t compass_run(uint32_t now);

#endif
