/* SPDX-License-Identifier: MIT */
/* Version of the firmware: in `identity`, and as release number in the USB descriptor. */
#ifndef ECHOSTEP_VERSION_H
#define ECHOSTEP_VERSION_H

#define VERSION_MAJOR 1
#define VERSION_MINOR 9 /* one digit */
#define VERSION_PATCH 1 /* one digit */

#endif
