#!/bin/sh
# SPDX-License-Identifier: MIT
# Install Debian packages that are missing; exit 1 without a word of error when this user may not.
missing=""
for package in "$@"; do
	dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q "ok installed" || missing="$missing $package"
done
[ -z "$missing" ] && exit 0
command -v apt-get >/dev/null || exit 1
if [ "$(id -u)" = 0 ]; then
	as_root=""
elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
	as_root="sudo -n"
else
	exit 1
fi
echo "Installing:$missing"
export DEBIAN_FRONTEND=noninteractive
{ $as_root apt-get update && $as_root apt-get install -y --no-install-recommends $missing; } >/tmp/echostep-apt.log 2>&1 && exit 0
echo "apt failed; see /tmp/echostep-apt.log"
exit 1
