/* What the parts of the USB driver share: usb.c moves the bytes of the port, usb_control.c answers the host's requests, with
 * usb_descriptors.c. */
#ifndef ECHOSTEP_AVR_USB_H
#define ECHOSTEP_AVR_USB_H

#include <stdbool.h>
#include <stdint.h>

enum { EP_CONTROL, EP_NOTIFY, EP_OUT, EP_IN };
#define EP_COUNT 4u
#define EP_SIZE 64u
#define NOTIFY_SIZE 16u

/* usb.c */
void usb_enable(uint8_t endpoint, uint8_t type, uint8_t memory); /* UECFG0X and UECFG1X; selects the endpoint */
void usb_start_port(void);                                       /* the host chose our configuration */
void usb_empty_port(void);                                       /* nothing that waited reaches the next host program */

/* usb_descriptors.c */
const uint8_t *usb_descriptor(uint16_t value, uint8_t *length); /* wValue of the request; in flash; 0: there is none */

/* usb_control.c */
void control_start(void); /* after a bus reset, and when the cable is pulled: no address, no configuration, port closed */
void control_run(void);
bool control_configured(void);
bool control_port_open(void);

#endif
