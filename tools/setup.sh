#!/bin/sh
# SPDX-License-Identifier: MIT
# Install echostep, its tests and its tools into an environment: tools/setup.sh .venv/bin. All packages of tested-versions.txt, each checked against
# its hashes; where the package index lacks one of them, the newest ones, and that is said. A file with another hash is an error.
pip="$1/pip"
quiet="--quiet --disable-pip-version-check"
log=$(mktemp) || exit 1
trap 'rm -f "$log"' EXIT
if "$pip" install $quiet --require-hashes -r host/tested-versions.txt 2>"$log"; then
	exec "$pip" install $quiet --no-deps --no-build-isolation -e host -e host/studies
fi
if grep -q "DO NOT MATCH THE HASHES" "$log"; then
	cat "$log" >&2
	exit 1
fi
grep "^ERROR" "$log"
echo "The package index lacks some tested version: installing the newest ones, without a check of their hashes."
exec "$pip" install $quiet -e 'host[dev]' -e 'host/studies[cluster]'
