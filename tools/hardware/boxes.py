# SPDX-License-Identifier: MIT
"""The printed boxes (`make hardware`): each part from its OpenSCAD source to STL, checked to be a closed surface, and drawn for the README.

In: firmware/hardware/boxes/*.scad; the program openscad. Out: NAME-PART.stl and NAME.png beside the source; what was found on
standard output, exit status 1 when a surface is not closed. Each file states the sources that it was made from. Owns nothing.
"""

from __future__ import annotations

import argparse
import hashlib
import subprocess
import sys
from pathlib import Path

import numpy as np
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from hardware import HARDWARE, solids
from hardware.solids import Triangles, faults, picture, read_stl, volume, write_stl
from places import OUT

BOXES = HARDWARE / "boxes"
NAMES = ("belt_box", "ranger_holder", "imu_clip", "ankle_box")
PARTS = ("box", "lid")
STL = OUT / "hardware"
HEADER = "echostep, made from "  # of a binary STL file; `solid` would mark one as text
WIDTH = 420  # of a part's picture, pixels


def sources(name: str) -> str:
    """A fingerprint of all that a picture is made from."""
    files = (BOXES / "common.scad", BOXES / f"{name}.scad", Path(solids.__file__))
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:16]


def compiled(name: str, part: str, out: Path) -> Triangles:
    """A part by OpenSCAD, by way of a text file in `out`."""
    out.mkdir(parents=True, exist_ok=True)
    path = out / f"{name}-{part}.stl"
    command = ["openscad", "-q", "-D", f'part="{part}"', "-o", str(path), str(BOXES / f"{name}.scad")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode or done.stderr:
        raise SystemExit(f"{name}, {part}: {done.stderr}")
    return read_stl(path)


def draw(name: str, parts: list[Triangles]) -> None:
    """The parts of a box side by side, as the picture beside its source."""
    drawn = [picture(triangles, WIDTH) for triangles in parts]
    height = max(len(one) for one in drawn)
    padded = [np.pad(one, ((0, height - len(one)), (0, 0), (0, 0)), constant_values=255) for one in drawn]
    made_from = PngInfo()
    made_from.add_text("Source", sources(name))
    Image.fromarray(np.concatenate(padded, axis=1)).quantize(64).save(
        BOXES / f"{name}.png", pnginfo=made_from, optimize=True
    )


def main() -> int:
    """Make, check and draw all boxes."""
    argparse.ArgumentParser(description=__doc__.partition("\n")[0]).parse_args()
    sound = True
    for name in NAMES:
        parts = [compiled(name, part, STL) for part in PARTS]
        for part, triangles in zip(PARTS, parts, strict=True):
            write_stl(BOXES / f"{name}-{part}.stl", triangles, f"{HEADER}{sources(name)}")
            size = np.ptp(triangles.reshape(-1, 3), axis=0)
            found = faults(triangles)
            sound &= not found
            print(f"{name} {part}: {size[0]:.1f} x {size[1]:.1f} x {size[2]:.1f} mm, {volume(triangles) / 1000:.1f} cm3, "
                  f"{'; '.join(found) or 'closed'}")  # fmt: skip
        draw(name, parts)
    return 0 if sound else 1


if __name__ == "__main__":
    sys.exit(main())
