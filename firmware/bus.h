/* SPDX-License-Identifier: MIT */
/* Who may use the I2C bus: it is kept free for the rangers' triggers, whose times matter. */
#ifndef ECHOSTEP_BUS_H
#define ECHOSTEP_BUS_H

#include <stdbool.h>
#include <stdint.h>

/* The next trigger of a ranger (RANGER_LEFT, RANGER_RIGHT) is at `due`, or none is planned. */
void bus_plan_trigger(uint8_t side, bool planned, uint32_t due);

/* Whether no trigger is due within the next 1.25 ms, which is longer than any other transfer takes. */
bool bus_is_quiet(uint32_t now);

#endif
