#!/bin/sh
# SPDX-License-Identifier: MIT
# Run README's two commands on another system: tools/elsewhere.sh [SUITE]. A root folder of Debian testing is made by debootstrap in out/elsewhere, the
# newest commit is cloned into it, and both commands run there in a chroot, from nothing. Prints versions here and there, times, and how each command
# ended; whole outputs are in out/elsewhere/*.log. Needs root.
cd "$(dirname "$0")/.." || exit 2
suite=${1:-testing}
root=$PWD/out/elsewhere/$suite
mkdir -p out/elsewhere
[ "$(id -u)" = 0 ] || { echo "make elsewhere: a chroot needs root: sudo make elsewhere" >&2; exit 2; }
tools/apt.sh debootstrap || exit 2
mirror=$(sed -n 's/^\(URIs:\|deb\) *\(http[^ ]*\/debian\)\( .*\)*$/\2/p' /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null | head -n 1)

[ -e "$root/etc/debian_version" ] || debootstrap --variant=minbase --include=ca-certificates,git,make "$suite" "$root" "${mirror:-http://deb.debian.org/debian}" >"out/elsewhere/$suite-debootstrap.log" || exit 1
# The network as it is here: names, proxies, certificates.
cp /etc/resolv.conf /etc/hosts "$root/etc/"
cp /etc/apt/apt.conf.d/* "$root/etc/apt/apt.conf.d/"
[ ! -e /etc/pip.conf ] || cp /etc/pip.conf "$root/etc/"
mkdir -p "$root/usr/local/share/ca-certificates"
find /usr/local/share/ca-certificates -name '*.crt' -exec cp {} "$root/usr/local/share/ca-certificates/" \;
leave() {
	for folder in dev/shm dev/pts dev proc sys; do
		umount -l "$root/$folder" 2>/dev/null
	done
}
trap leave EXIT
for folder in proc sys dev dev/pts dev/shm; do
	mount --bind "/$folder" "$root/$folder" || exit 1
done
there() {
	chroot "$root" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 "PIP_DEFAULT_TIMEOUT=${PIP_DEFAULT_TIMEOUT:-60}" sh -c "$1"
}
there 'update-ca-certificates && apt-get update && apt-get dist-upgrade -y' >"out/elsewhere/$suite-apt.log" 2>&1 || exit 1
rm -rf "$root/root/echostep" "$root/root/.cache"
git clone --quiet . "$root/root/echostep"

versions='for program in python3 avr-gcc cc clang cppcheck chromium; do printf "  %s: " $program; { $program --version 2>/dev/null || echo missing; } | head -n 1; done'
timed() {
	began=$(date +%s)
	there "cd /root/echostep && $1" >"out/elsewhere/$suite-$2.log" 2>&1
	status=$?
	echo "$1: exit status $status after $(($(date +%s) - began)) s"
	grep -E '^(error:|estimates:|FAILED|ERROR|make.*Error|E: |[0-9]+ (passed|failed))' "out/elsewhere/$suite-$2.log"
	ended=$((${ended:-0} + status))
}
timed "make demo" demo
timed "make test" test
echo "Here:"
sh -c "$versions"
echo "There, $suite:"
there "$versions"
exit "$ended"
