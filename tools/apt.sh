#!/bin/sh
# SPDX-License-Identifier: MIT
# Install the Debian packages that are missing, each that can be had; where one cannot, say why in one line and exit 1.
missing=""
for package in "$@"; do
	dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q "ok installed" || missing="$missing $package"
done
[ -z "$missing" ] && exit 0
fail() {
	echo "Not installed:$missing: $1"
	exit 1
}
command -v apt-get >/dev/null || fail "there is no apt-get on this system."
if [ "$(id -u)" = 0 ]; then
	as_root=""
elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
	as_root="sudo -n"
else
	fail "this user has no right to (neither root nor sudo without a password)."
fi
log=$(mktemp) || exit 1
trap 'rm -f "$log"' EXIT
echo "Installing:$missing"
export DEBIAN_FRONTEND=noninteractive
# A list that cannot be renewed may still name packages that can be fetched.
$as_root apt-get update >"$log" 2>&1
install() {
	$as_root apt-get install -y --no-install-recommends "$@" >>"$log" 2>&1
}
install $missing && exit 0
# One that this system does not have keeps apt from installing the others.
refused=""
for package in $missing; do
	install "$package" || refused="$refused $package"
done
missing=$refused
[ -z "$missing" ] && exit 0
if grep -q "is expired" "$log"; then
	fail "apt's package list has expired."
fi
reason=$(grep -m 1 "^E: " "$log" || grep -m 1 "^W: " "$log") || reason="apt-get failed without a word."
fail "apt says: ${reason#?: }"
