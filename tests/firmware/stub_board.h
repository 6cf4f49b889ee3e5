/* SPDX-License-Identifier: MIT */
#include "board.h"
#include "messages.h" /* RESET_CAUSE_* */

uint8_t stub_input(void); /* what a chip answers on SPI, or the levels of lines; all ones: nothing is there */
