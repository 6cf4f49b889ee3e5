/* SPDX-License-Identifier: MIT */
/* Which part sits in each place: noted by the drivers, sent as `parts` to a host that has subscribed. */
#ifndef ECHOSTEP_PARTS_H
#define ECHOSTEP_PARTS_H

#include <stdint.h>
#include "status.h" /* enum device: the places */

/* In the order of the fields of `parts`: the devices of `status`, then the foot. */
#define PLACE_FOOT ((uint8_t)(DEVICE_PRESSURE + 1))

/* A part (PART_*) has answered in this place, with this content of its identity register (0: it has none). */
void parts_found(uint8_t place, uint8_t part, uint8_t identity);

/* The part that was found last in this place, PART_*. */
uint8_t parts_in(uint8_t place);

/* Whether the wiring is one that the firmware refuses, WIRING_*. */
void parts_set_wiring(uint8_t wiring);

void parts_send(void);

#endif
