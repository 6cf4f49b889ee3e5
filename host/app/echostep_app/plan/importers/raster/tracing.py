# SPDX-License-Identifier: MIT
"""A picture's grey values; pixels that are walls -> outlines.

In: a file; a boolean picture. Out: grey values; polygons in pixels, x right, y up, the origin at the lower left corner. Owns what counts as noise.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry import Polygon

from echostep.arrays import Bools, Floats
from echostep.errors import EchostepError
from echostep_app.extras import require
from echostep_app.plan.importers.parsing import read_bytes

MOST_PIXELS = 100_000_000

STAIR = 1.5  # pixels by which an outline may leave the pixels' edges: the corners of a slanting wall's stair are up to 1.41 from its line
LEAST_PIXELS = 4.0  # smaller groups are sensor noise; assumed
MOST_RUNS = 2_000_000


def grey(path: Path, transparent: int) -> Floats:
    """The picture's grey values as viewers show it (rows from the top, columns), 0 black to 255 white, on a ground of the value `transparent`."""
    require(f"{path}: a picture", "PIL")
    from PIL import Image, ImageOps

    content = read_bytes(path)
    Image.MAX_IMAGE_PIXELS = MOST_PIXELS
    try:
        with Image.open(BytesIO(content)) as image:
            if image.width * image.height > MOST_PIXELS:
                raise EchostepError(f"{path}: more than {MOST_PIXELS // 10**6} million pixels: cut it to the building")
            return _grey(ImageOps.exif_transpose(image), transparent)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        reason = str(error).partition(" <")[0][:200]  # behind it stands an address in memory
        raise EchostepError(f"{path}: not a picture that can be read: {reason}") from error


def _grey(image: Any, ground: int) -> Floats:
    from PIL import Image

    if image.mode[0] in "IF":  # 16 bits a pixel and more, or numbers of any size
        values = np.asarray(image, dtype=np.float64)
        greatest = float(np.nan_to_num(values).max())
        most = next(most for most in (1.0, 255.0, 65535.0, greatest) if greatest <= most)
        return np.rint(np.clip(values * 255.0 / most, 0.0, 255.0))
    if image.has_transparency_data:
        image = image.convert("RGBA")
        image = Image.alpha_composite(Image.new("RGBA", image.size, (ground, ground, ground, 255)), image)
    return np.asarray(image.convert("L"), dtype=np.float64)


def trace(walls: Bools, path: Path) -> tuple[list[Polygon], int]:
    """Outlines of the groups of pixels (rows from the top, columns) of a picture, and how many groups are left out as noise."""
    rows, first, last = _runs(walls)
    if len(rows) > MOST_RUNS:
        raise EchostepError(f"{path}: too many pixels of walls: cut the picture to the building")
    height = len(walls)
    boxes = shapely.box(first, height - rows - 1, last, height - rows)
    groups = [part for part in shapely.get_parts(shapely.union_all(boxes)) if isinstance(part, Polygon)]
    large = [group for group in groups if group.area >= LEAST_PIXELS]
    smooth = [
        group.normalize().simplify(STAIR) for group in large
    ]  # a normalised ring begins at a corner: its beginning stays
    return [s if isinstance(s, Polygon) and s.area > 0.0 else g for s, g in zip(smooth, large, strict=True)], len(
        groups
    ) - len(large)


def _runs(walls: Bools) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Row, first column and column after the last of each run of set pixels."""
    padded = np.pad(walls.astype(np.int8), ((0, 0), (1, 1)))
    step = np.diff(padded, axis=1)
    rows, first = np.nonzero(step == 1)
    _, last = np.nonzero(step == -1)
    return rows, first, last
