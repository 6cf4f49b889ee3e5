/* SPDX-License-Identifier: MIT */
/* Shared by the parts of the USB driver: usb.c moves the bytes of the port, usb_control.c answers the host's requests,
 * usb_descriptors.c holds the descriptors. */
#ifndef ECHOSTEP_AVR_USB_H
#define ECHOSTEP_AVR_USB_H

#include <stdbool.h>
#include <stdint.h>

enum { EP_CONTROL, EP_NOTIFY, EP_OUT, EP_IN };
#define EP_COUNT 4u
#define EP_SIZE 64u
#define NOTIFY_SIZE 16u

/* usb.c */
/* `type` for UECFG0X, `memory` for UECFG1X; selects the endpoint */
void usb_enable(uint8_t endpoint, uint8_t type, uint8_t memory);
/* enables the port's endpoints when the host sets the configuration */
void usb_start_port(void);
void usb_empty_port(void);                                       /* drops the bytes that wait for the host */

/* usb_descriptors.c */
uint8_t usb_descriptor_length(uint16_t value);               /* by the request's wValue; 0: there is none */
uint8_t usb_descriptor_byte(uint16_t value, uint8_t index); /* below that length */

/* usb_control.c */
void usb_control_start(void); /* after a bus reset and while unplugged: no configuration, port closed */
void usb_control_run(void);   /* does the next step of the request under way */
bool usb_control_is_configured(void);
bool usb_control_port_is_open(void); /* DTR */

#endif
