#!/bin/sh
# SPDX-License-Identifier: MIT
# Write the firmware to a board through its bootloader: tools/flash.sh PORT [HEX]. Port and avrdude are checked before anything is built;
# without HEX the firmware is built, or the one that comes with the package is taken where avr-gcc is missing. Needs no Python.
cd "$(dirname "$0")/.." || exit 2
port=$1
hex=$2
fail() {
	echo "make flash: $1" >&2
	exit 2
}
[ -n "$port" ] || fail "say which port the board is at: make flash PORT=/dev/ttyACM0"
[ -e "$port" ] || fail "$port: there is no such port; plug the board in; see ls /dev/serial/by-id"
[ -c "$port" ] || fail "$port is no serial port; name one such as /dev/ttyACM0"
[ -r "$port" ] && [ -w "$port" ] || fail "$port: this user may not open it: sudo usermod -aG dialout \$USER, then log out and in"
command -v avrdude >/dev/null || tools/apt.sh avrdude || fail "avrdude is not installed: sudo apt install avrdude"
if [ -z "$hex" ]; then
	hex=host/app/echostep_app/firmware/echostep.hex
	if command -v avr-gcc >/dev/null || tools/apt.sh gcc-avr avr-libc binutils-avr; then
		make -C firmware || exit 2
		hex=firmware/build/echostep.hex
	else
		echo "avr-gcc is not installed: the firmware that comes with the package is written"
	fi
fi
[ -r "$hex" ] || fail "$hex: there is no such file"
digest=$({ sha256sum "$hex" 2>/dev/null || shasum -a 256 "$hex"; } | cut -d " " -f 1)
[ ! -r "$hex.sha256" ] || [ "$(head -n 1 "$hex.sha256" | cut -d " " -f 1)" = "$digest" ] || fail "$hex: its SHA-256 is $digest, not that of $hex.sha256: make firmware"
echo "$hex: SHA-256 $digest"

# Opening the port at 1200 Bd and closing it starts the bootloader, which appears as another port or as this one anew.
before=$(ls /dev/ttyACM* /dev/cu.usbmodem* 2>/dev/null)
device=$(readlink -f "$port")
stty -F "$port" 1200 hupcl 2>/dev/null || stty -f "$port" 1200 hupcl || fail "$port: cannot open the port"
bootloader=""
gone=""
for _ in $(seq 100); do
	sleep 0.1
	[ -e "$port" ] && [ "$(readlink -f "$port")" = "$device" ] || gone=1
	for new in $(ls /dev/ttyACM* /dev/cu.usbmodem* 2>/dev/null); do
		echo "$before" | grep -qx "$new" || bootloader=$new
	done
	[ -z "$bootloader" ] && [ -n "$gone" ] && [ -e "$port" ] && bootloader=$port
	[ -n "$bootloader" ] && [ -w "$bootloader" ] && break
done
[ -n "$bootloader" ] || fail "$port: the board did not enter its bootloader in 10 s: press its reset button (Pro Micro: twice, quickly) and run this again within eight seconds"
avrdude -p atmega32u4 -c avr109 -P "$bootloader" -b 57600 -D -U "flash:w:$hex:i" || fail "avrdude failed, see above: press the reset button (Pro Micro: twice, quickly) and run this again within eight seconds"
echo "Written and verified. Next: echostep doctor"
