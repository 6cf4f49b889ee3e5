#!/bin/sh
# One would expect a package that declares Python 3.11 to install on the Python 3.11 of Debian 12, which is 3.11.2.
# soupsieve 4.1.2 wants 3.11.5 at least, and it comes with beautifulsoup4, which comes with the furo theme of Sphinx.
# It hurts who locks versions on a newer 3.11 and installs them on Debian 12: no file fits. A universal lock must start at 3.11.2, not at 3.11.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
fits() {
	"$folder/env/bin/pip" download --quiet --disable-pip-version-check --no-deps --only-binary :all: --dest "$folder/$1" \
		--python-version "$1" soupsieve==4.1.2 >"$folder/log" 2>&1
}
fits 3.11.5 && newer=fits || newer="does not fit"
fits 3.11.2 && older=fits || older="does not fit"
echo "soupsieve 4.1.2: on Python 3.11.5 it $newer, on 3.11.2 it $older"
[ "$newer $older" = "fits does not fit" ] || { echo "this has changed"; exit 1; }
