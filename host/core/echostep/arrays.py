# SPDX-License-Identifier: MIT
"""Types of numpy arrays that annotations use everywhere, runs of a condition, and the numpy dtype of a record that a Protocol describes.

In: a Protocol class with annotated fields. Out: names of array types; dtypes of records. Owns nothing.
"""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Int32s = NDArray[np.int32]
Bools = NDArray[np.bool_]
Octets = NDArray[np.uint8]
Records = NDArray[np.void]

_SCALARS = {"float": "f8", "int": "i8"}
_ARRAYS = {"Floats": "f8", "Ints": "i8"}


def spans(holds: Bools) -> Ints:
    """Runs of True in a condition (n,): (k, 2) the first index of each, and the index after its last."""
    return np.flatnonzero(np.diff(holds, prepend=False, append=False)).reshape(-1, 2)


def record_dtype(protocol: type, array_size: int | None = None, **sizes: int) -> np.dtype[np.void]:
    """Dtype with one field for each annotation of `protocol`, base classes first: float, int, Floats or Ints.

    An array has `sizes[name]` values, or `array_size` if every array has the same size. The module of `protocol` must postpone the evaluation of its
    annotations. A kernel reads and writes the fields of such a record as attributes.
    """
    fields: list[Any] = []
    for base in reversed(protocol.__mro__):
        for name, kind in inspect.get_annotations(base).items():
            if kind in _SCALARS:
                fields.append((name, _SCALARS[kind]))
            else:
                fields.append((name, _ARRAYS[kind], sizes[name] if array_size is None else array_size))
    return np.dtype(fields)
